"""The remover as a component of a container of its own, with intra-process communication.

ros2 launch dynains_ros remover.launch.py points:=/velodyne_points
ros2 launch dynains_ros remover.launch.py points:=/front/points,/rear/points
ros2 launch dynains_ros remover.launch.py points:=/livox/lidar odometry:=true  # before any SLAM
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import ComposableNodeContainer
from launch_ros.descriptions import ComposableNode
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

ARGUMENTS = {
    "points": ("points", "topic of the clouds, or topics A,B,C of several LiDARs"),
    "fixed_frame": ("odom", "frame without jumps"),
    "odometry": ("false", "poses are found by the clouds alone, without transforms"),
    "publish_odom": ("false", "with odometry: publish odom and its transform"),
    "namespace": ("dynains", "namespace of the node and its topics static, dynamic and map"),
    "use_sim_time": ("false", "time of /clock, for logs that are played"),
    "parameters": (PathJoinSubstitution([FindPackageShare("dynains_ros"), "config",
                                         "remover.yaml"]), "file of all other parameters"),
}


def generate_launch_description():
    value = LaunchConfiguration
    node = ComposableNode(
        package="dynains_ros", plugin="dynains_ros::RemoverNode", name="remover",
        namespace=value("namespace"),
        parameters=[value("parameters"),
                    {"topics": value("points"), "fixed_frame": value("fixed_frame"),
                     "odometry": ParameterValue(value("odometry"), value_type=bool),
                     "publish_odom": ParameterValue(value("publish_odom"), value_type=bool),
                     "use_sim_time": ParameterValue(value("use_sim_time"), value_type=bool)}],
        extra_arguments=[{"use_intra_process_comms": True}])
    container = ComposableNodeContainer(
        name="container", namespace=value("namespace"), package="rclcpp_components",
        executable="component_container", composable_node_descriptions=[node], output="screen")
    return LaunchDescription(
        [DeclareLaunchArgument(name, default_value=default, description=text)
         for name, (default, text) in ARGUMENTS.items()] + [container])
