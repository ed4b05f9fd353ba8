"""check_bag.py BAG SEQUENCE: a simulated bag, read by python3-rosbag, holds the points of the folder."""

import pathlib
import sys

try:
    import rosbag
except ImportError as error:
    print("SKIPPED:", error)
    sys.exit(0)


def main(bag_file, sequence):
    files = sorted((sequence / "velodyne").iterdir())
    with rosbag.Bag(str(bag_file)) as bag:
        types = bag.get_type_and_topic_info().topics
        assert {name: topic.msg_type for name, topic in types.items()} == {
            "/points": "sensor_msgs/PointCloud2", "/tf": "tf2_msgs/TFMessage"}
        clouds = [message for _, message, _ in bag.read_messages(topics=["/points"])]
        transforms = [message for _, message, _ in bag.read_messages(topics=["/tf"])]
    assert len(clouds) == len(transforms) == len(files) > 0
    for cloud, file in zip(clouds, files):
        labels = (sequence / "labels" / (file.stem + ".label")).read_bytes()
        points = file.read_bytes()
        assert cloud.width * 16 == len(points) and cloud.point_step == 20
        for i in range(cloud.width):
            row = cloud.data[20 * i:20 * i + 20]
            assert row == points[16 * i:16 * i + 16] + labels[4 * i:4 * i + 4]
    times = [float(line) for line in (sequence / "times.txt").read_text().split()]
    for cloud, message, time in zip(clouds, transforms, times):
        (transform,) = message.transforms
        assert transform.header.frame_id == "map" and transform.child_frame_id == "lidar"
        assert cloud.header.frame_id == "lidar"
        assert abs(transform.header.stamp.to_sec() - 1.0 - time) < 1e-6
        q = transform.transform.rotation
        assert abs(q.x ** 2 + q.y ** 2 + q.z ** 2 + q.w ** 2 - 1.0) < 1e-9
    print(len(clouds), "clouds are equal")


main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
