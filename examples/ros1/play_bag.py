"""play_bag.py PROGRAM NODE WORK: plays a simulated bag to the node, by roscore and rosbag.

The node must publish the points of each cloud that `dynains run --write-online` labels.
"""

import os
import pathlib
import shutil
import socket
import struct
import subprocess
import sys
import time

try:
    import rospy
    from geometry_msgs.msg import PoseWithCovarianceStamped
    from sensor_msgs.msg import PointCloud2
except ImportError as error:
    print("SKIPPED:", error)
    sys.exit(0)

SCANS = 40  # a scan enters the map 30 scans later
STATIC, MOVING = 9, 251
PATIENCE = 60.0  # s
WRITER = pathlib.Path(__file__).parents[2] / "tests" / "program" / "write_bag.py"


def free_port():
    with socket.socket() as any_port:
        any_port.bind(("localhost", 0))
        return any_port.getsockname()[1]


def wait_for(condition, purpose):
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "waited in vain for " + purpose
        time.sleep(0.05)


def has_master():
    try:
        rospy.get_master().getPid()
        return True
    except OSError:
        return False


def counts_of(labels):
    classes = [label & 0xFFFF for (label,) in struct.iter_unpack("<I", labels.read_bytes())]
    return classes.count(STATIC), classes.count(MOVING)


def main(program, node, work):
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    bag = work / "drive.bag"
    subprocess.run([program + "_simulate", work / "seq", "--sensor", "vlp16", "--scans", str(SCANS),
                    "--quiet"], check=True)
    subprocess.run([sys.executable, WRITER, work / "seq", bag, "none"], check=True)
    subprocess.run([program, "run", bag, "--out", work / "out", "--min-range", "2.5",
                    "--pose-topic", "/tf", "--write-online", "--quiet"], check=True)
    expected = [counts_of(file) for file in sorted((work / "out" / "online").iterdir())]
    assert len(expected) == SCANS and sum(moving for _, moving in expected) > 0

    port = free_port()
    os.environ.update(ROS_MASTER_URI=f"http://localhost:{port}", ROS_HOSTNAME="localhost",
                      ROS_LOG_DIR=str(work / "ros_log"), ROS_HOME=str(work / "ros_home"))
    started = []

    def start(*command):
        started.append(subprocess.Popen([str(part) for part in command]))

    try:
        start("roscore", "-p", port)
        wait_for(has_master, "roscore")
        rospy.init_node("play_bag", disable_signals=True)
        received = {"static": [], "dynamic": [], "map": []}
        for topic, messages in received.items():
            rospy.Subscriber("/dynains/" + topic, PointCloud2, messages.append)
        residuals = []
        rospy.Subscriber("/dynains/residual", PoseWithCovarianceStamped, residuals.append)
        start(node, "points:=/velodyne", "_fixed_frame:=odom", "_map_period:=0.3", "_queue:=100", "_tf_timeout:=10",
              "_min_range:=2.5")
        # Nobody subscribes to the other topics of the bag.
        start("rosbag", "play", "--quiet", "--wait-for-subscribers", "--delay=1", "--rate=2",
              bag, "--topics", "/velodyne", "/tf", "/tf_static")
        wait_for(lambda: len(received["dynamic"]) == SCANS and len(received["static"]) == SCANS,
                 f"{SCANS} clouds")
        newest = received["static"][-1].header.stamp
        wait_for(lambda: received["map"] and received["map"][-1].header.stamp == newest, "the map")
    finally:
        for process in reversed(started):
            process.terminate()
            process.wait()
    counts = [(still.width, moving.width)
              for still, moving in zip(received["static"], received["dynamic"])]
    assert counts == expected, f"expected {expected}, found {counts}"
    map_message = received["map"][-1]
    assert map_message.header.frame_id == "odom" and map_message.width > 1000
    assert len(map_message.data) == 12 * map_message.width
    assert len(residuals) > SCANS / 2, f"{len(residuals)} residuals"
    way = sum((r.pose.pose.position.x ** 2 + r.pose.pose.position.y ** 2) ** 0.5
              for r in residuals)
    assert 5 < way < 40, f"{way} m"
    assert all(0 < r.pose.covariance[0] < 1 for r in residuals)
    print(SCANS, "clouds and", map_message.width, "points of the map")


main(sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]))
