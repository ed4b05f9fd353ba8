"""check_clean_log.py LOG COPY LABELS: by an independent reader, the copy that `dynains run --write-log`
made of a .bag (python3-rosbag) or .db3 (sqlite3) has the same messages, and clouds without the points
that are moving by the files in the folder LABELS."""

import pathlib
import sqlite3
import struct
import sys


def kept_points(data, step, labels):
    assert len(data) == step * len(labels), "labels are of another cloud"
    return b"".join(data[step * i:step * (i + 1)]
                    for i, label in enumerate(labels) if label & 0xffff != 251)


def labels_of(folder):
    for file in sorted(pathlib.Path(folder).iterdir()):
        data = file.read_bytes()
        yield struct.unpack("<%dI" % (len(data) // 4), data)


def compare_bags(log, copy, labels):
    try:
        import rosbag
    except ImportError as error:
        print("SKIPPED:", error)
        sys.exit(0)
    moving = 0
    with rosbag.Bag(log) as a, rosbag.Bag(copy) as b:
        headers = lambda bag: [(c.id, c.topic, c.datatype, c.md5sum, c.msg_def, c.header)
                               for c in bag._get_connections()]
        assert headers(a) == headers(b)
        assert a.get_compression_info().compression == b.get_compression_info().compression
        assert a.get_message_count() == b.get_message_count() > 0
        assert (a.get_start_time(), a.get_end_time()) == (b.get_start_time(), b.get_end_time())
        for one, other in zip(a.read_messages(raw=True), b.read_messages(raw=True)):
            assert one.topic == other.topic and one.timestamp == other.timestamp
            if one.message[0] != "sensor_msgs/PointCloud2":
                assert one.message[:3] == other.message[:3]
        for one, other in zip(a.read_messages(), b.read_messages()):
            if one.message._type != "sensor_msgs/PointCloud2":
                continue
            cloud, clean = one.message, other.message
            assert clean.header == cloud.header and clean.fields == cloud.fields
            assert clean.point_step == cloud.point_step and clean.height == 1
            assert clean.row_step == len(clean.data) == clean.width * clean.point_step
            assert clean.data == kept_points(cloud.data, cloud.point_step, next(labels))
            moving += cloud.width - clean.width
    return moving


def cloud_of(message):
    """Everything but sizes, the step of a point, and the points."""
    position = 4

    def number(kind):
        nonlocal position
        size = struct.calcsize(kind)
        position += -(position - 4) % size + size
        return struct.unpack("<" + kind, message[position - size:position])[0]

    def text():
        nonlocal position
        length = number("I")
        position += length
        return message[position - length:position]

    head = [number("i"), number("I"), text()]
    size = [number("I"), number("I")]
    head += [(text(), number("I"), number("B"), number("I")) for _ in range(number("I"))]
    head += [number("B")]
    step, row = number("I"), number("I")
    length = number("I")
    data, tail = message[position:position + length], message[position + length:]
    assert size[0] == 1 and row == length == size[1] * step
    return (head, step, tail), step, data


def compare_databases(log, copy, labels):
    moving = 0
    a, b = sqlite3.connect(log), sqlite3.connect(copy)
    assert b.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
    schema = "SELECT type, name, sql FROM sqlite_master ORDER BY name"
    assert a.execute(schema).fetchall() == b.execute(schema).fetchall()
    tables = [row[1] for row in a.execute(schema) if row[0] == "table"]
    for table in set(tables) - {"messages"}:
        assert list(a.execute("SELECT * FROM " + table)) == list(b.execute("SELECT * FROM " + table))
    clouds = {row[0] for row in a.execute(
        "SELECT id FROM topics WHERE type = 'sensor_msgs/msg/PointCloud2'")}
    query = "SELECT id, topic_id, timestamp, data FROM messages ORDER BY id"
    for one, other in zip(a.execute(query), b.execute(query)):
        assert one[:3] == other[:3]
        if one[1] not in clouds:
            assert one[3] == other[3]
            continue
        head, step, data = cloud_of(one[3])
        clean_head, _, clean = cloud_of(other[3])
        assert clean_head == head
        assert clean == kept_points(data, step, next(labels))
        moving += (len(data) - len(clean)) // step
    count = "SELECT COUNT(*) FROM messages"
    assert a.execute(count).fetchone() == b.execute(count).fetchone()
    return moving


def main(log, copy, folder):
    labels = labels_of(folder)
    compare = compare_bags if log.endswith(".bag") else compare_databases
    moving = compare(log, copy, labels)
    assert moving > 0 and next(labels, None) is None
    print("the copy lacks", moving, "moving points and is equal")


main(sys.argv[1], sys.argv[2], sys.argv[3])
