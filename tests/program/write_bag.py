"""write_bag.py SEQUENCE BAG COMPRESSION: a KITTI folder as a bag of ROS 1, by python3-rosbag.

Odometry is that of a frame base_link, as transforms, too; a static transform leads from there to the
frame of the clouds.
"""

import pathlib
import sys

try:
    import numpy as np
    import rosbag
    import rospy
    from geometry_msgs.msg import TransformStamped
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import PointCloud2, PointField
    from tf2_msgs.msg import TFMessage
except ImportError as error:
    print("SKIPPED:", error)
    sys.exit(0)

LEVER = (0.5, 0.0, 1.5)  # of the lidar in base_link, m


def matrix_of(numbers):
    """A 4x4 matrix from the 12 numbers of a line."""
    return np.vstack([np.array(numbers, float).reshape(3, 4), [0, 0, 0, 1]])


def set_pose(position, rotation, pose):
    position.x, position.y, position.z = pose[:3, 3]
    w = 0.5 * np.trace(pose) ** 0.5
    assert w > 0.1, "the vehicle turns around"
    rotation.w = w
    rotation.x = (pose[2, 1] - pose[1, 2]) / (4.0 * w)
    rotation.y = (pose[0, 2] - pose[2, 0]) / (4.0 * w)
    rotation.z = (pose[1, 0] - pose[0, 1]) / (4.0 * w)


def stamped(kind, frame, child, stamp=None):
    message = kind()
    message.header.stamp = stamp or rospy.Time()
    message.header.frame_id = frame
    message.child_frame_id = child
    return message


def cloud_of(file, stamp):
    cloud = PointCloud2()
    cloud.header.stamp = stamp
    cloud.header.frame_id = "velodyne"
    cloud.data = file.read_bytes()
    cloud.height = 1
    cloud.width = len(cloud.data) // 16
    cloud.point_step = 16
    cloud.row_step = len(cloud.data)
    cloud.fields = [PointField(name, 4 * i, PointField.FLOAT32, 1)
                    for i, name in enumerate(["x", "y", "z", "intensity"])]
    return cloud


def main(sequence, bag_file, compression):
    lines = [line.split() for line in (sequence / "calib.txt").read_text().splitlines()]
    (camera_from_lidar,) = [matrix_of(line[1:]) for line in lines if line[0] == "Tr:"]
    base_from_lidar = np.eye(4)
    base_from_lidar[:3, 3] = LEVER
    poses = [matrix_of(row) for row in np.loadtxt(sequence / "poses.txt")]
    times = np.loadtxt(sequence / "times.txt")
    with rosbag.Bag(str(bag_file), "w", compression=compression, chunk_threshold=200000) as bag:
        extrinsic = stamped(TransformStamped, "base_link", "velodyne")
        set_pose(extrinsic.transform.translation, extrinsic.transform.rotation, base_from_lidar)
        bag.write("/tf_static", TFMessage([extrinsic]), rospy.Time(1))
        for i, pose in enumerate(poses):
            stamp = rospy.Time.from_sec(1.0 + times[i])
            world_from_lidar = np.linalg.inv(camera_from_lidar) @ pose @ camera_from_lidar
            world_from_base = world_from_lidar @ np.linalg.inv(base_from_lidar)
            odometry = stamped(Odometry, "odom", "base_link", stamp)
            set_pose(odometry.pose.pose.position, odometry.pose.pose.orientation, world_from_base)
            bag.write("/odom", odometry, stamp)
            transform = stamped(TransformStamped, "odom", "base_link", stamp)
            set_pose(transform.transform.translation, transform.transform.rotation, world_from_base)
            bag.write("/tf", TFMessage([transform]), stamp)
            bag.write("/velodyne", cloud_of(sequence / "velodyne" / ("%06d.bin" % i), stamp), stamp)


main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3])
