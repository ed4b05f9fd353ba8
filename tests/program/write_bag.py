"""write_bag.py SEQUENCE BAG COMPRESSION: a KITTI folder as a bag of ROS 1, by python3-rosbag.

Odometry is that of a frame base_link, as transforms, too; a static transform leads from there to the
frame of the clouds.
"""

import pathlib
import sys

try:
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
    """Rows of a 4x4 matrix from the 12 numbers of a line."""
    values = [float(number) for number in numbers]
    return [values[0:4], values[4:8], values[8:12], [0.0, 0.0, 0.0, 1.0]]


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(4)) for j in range(4)] for i in range(4)]


def inverse(pose):
    rows = [[pose[j][i] for j in range(3)] for i in range(3)]
    shift = [-sum(rows[i][k] * pose[k][3] for k in range(3)) for i in range(3)]
    return [rows[i] + [shift[i]] for i in range(3)] + [[0.0, 0.0, 0.0, 1.0]]


def set_pose(position, rotation, pose):
    position.x, position.y, position.z = (pose[i][3] for i in range(3))
    w = 0.5 * (1.0 + pose[0][0] + pose[1][1] + pose[2][2]) ** 0.5
    assert w > 0.1, "the vehicle turns around"
    rotation.w = w
    rotation.x = (pose[2][1] - pose[1][2]) / (4.0 * w)
    rotation.y = (pose[0][2] - pose[2][0]) / (4.0 * w)
    rotation.z = (pose[1][0] - pose[0][1]) / (4.0 * w)


def lines_of(path):
    return [line.split() for line in path.read_text().splitlines()]


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
    camera_from_lidar = [matrix_of(line[1:]) for line in lines_of(sequence / "calib.txt")
                         if line[0] == "Tr:"][0]
    lidar_from_base = matrix_of([1, 0, 0, -LEVER[0], 0, 1, 0, -LEVER[1], 0, 0, 1, -LEVER[2]])
    poses = [matrix_of(line) for line in lines_of(sequence / "poses.txt")]
    times = [float(line[0]) for line in lines_of(sequence / "times.txt")]
    with rosbag.Bag(str(bag_file), "w", compression=compression, chunk_threshold=200000) as bag:
        extrinsic = TransformStamped()
        extrinsic.header.frame_id = "base_link"
        extrinsic.child_frame_id = "velodyne"
        set_pose(extrinsic.transform.translation, extrinsic.transform.rotation,
                 inverse(lidar_from_base))
        bag.write("/tf_static", TFMessage([extrinsic]), rospy.Time(1))
        for i, pose in enumerate(poses):
            stamp = rospy.Time.from_sec(1.0 + times[i])
            odometry = Odometry()
            odometry.header.stamp = stamp
            odometry.header.frame_id = "odom"
            odometry.child_frame_id = "base_link"
            world_from_lidar = product(product(inverse(camera_from_lidar), pose), camera_from_lidar)
            set_pose(odometry.pose.pose.position, odometry.pose.pose.orientation,
                     product(world_from_lidar, lidar_from_base))
            bag.write("/odom", odometry, stamp)
            transform = TransformStamped()
            transform.header = odometry.header
            transform.child_frame_id = "base_link"
            set_pose(transform.transform.translation, transform.transform.rotation,
                     product(world_from_lidar, lidar_from_base))
            bag.write("/tf", TFMessage([transform]), stamp)
            bag.write("/velodyne", cloud_of(sequence / "velodyne" / ("%06d.bin" % i), stamp), stamp)


main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3])
