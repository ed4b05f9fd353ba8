import os

import dynains
import numpy as np
import pytest


def test_a_recording_is_a_sequence_of_scans(drive, street):
    recording = dynains.Recording(drive)
    assert len(recording) == len(street)
    for recorded, scan in zip(recording, street):
        np.testing.assert_array_equal(recorded.points, scan.points)
        np.testing.assert_array_equal(recorded.labels, scan.labels)
        np.testing.assert_allclose(recorded.T_world_sensor, scan.T_world_sensor, atol=1e-9)
        assert recorded.time == pytest.approx(scan.time)
    assert recording[-1].name == recording.names[-1] == "000011"
    np.testing.assert_allclose(recording.times, [scan.time for scan in street])
    np.testing.assert_array_equal(recording.poses[3], recording[3].T_world_sensor)
    assert recording.has_labels
    scan = recording[0]
    assert np.shares_memory(scan.intensity, scan.points)
    assert scan.rings is None and scan.times is None
    assert (recording.missing_poses, recording.early_end, recording.frame) == (0, None, "sensor")
    assert recording.path == drive and "poses from poses.txt" in recording.notes
    with pytest.raises(IndexError):
        recording[len(street)]


def write_pcd(file, points):
    rows = "\n".join(f"{x} {y} {z} {i * 2} {i * 0.5}" for i, (x, y, z) in enumerate(points))
    file.write_text(
        "VERSION .7\nFIELDS x y z ring time\nSIZE 4 4 4 2 8\nTYPE F F F U F\nCOUNT 1 1 1 1 1\n"
        f"WIDTH {len(points)}\nHEIGHT 1\nVIEWPOINT 7 0 0 1 0 0 0\nPOINTS {len(points)}\n"
        f"DATA ascii\n{rows}\n"
    )


def test_columns_and_poses_of_pcd_files(tmp_path):
    points = np.arange(12, dtype=np.float32).reshape(4, 3)
    for i in range(2):
        write_pcd(tmp_path / f"{i}.pcd", points)
    scan = dynains.Recording(tmp_path, frame="sensor")[1]
    np.testing.assert_array_equal(scan.points[:, :3], points)
    assert scan.rings.dtype == np.uint16 and scan.rings.tolist() == [0, 2, 4, 6]
    assert scan.times.dtype == np.float64 and scan.times.tolist() == [0, 0.5, 1, 1.5]
    assert scan.intensity is None and scan.labels is None
    assert scan.T_world_sensor[:3, 3].tolist() == [7, 0, 0]


def test_what_the_files_mean_is_told_by_name(drive):
    plain = dynains.Recording(drive)
    other = dynains.Recording(drive, poses=drive / "poses_mm.txt", pose_units="mm")
    np.testing.assert_allclose(other.poses, plain.poses, atol=1e-6)
    assert other.options == {"poses": drive / "poses_mm.txt", "pose_units": "mm"}
    T = np.eye(4)
    T[0, 3] = 2.0
    as_array = dynains.Recording(drive, extrinsic=T)
    as_text = dynains.Recording(drive, extrinsic="2 0 0 0 0 0 1")
    np.testing.assert_allclose(as_array.poses, as_text.poses, atol=1e-9)
    np.testing.assert_allclose(as_array.poses, plain.poses @ T, atol=1e-9)
    moved = dynains.Recording(drive, sensor_origin=[1.0, 0, 1.5])
    as_text = dynains.Recording(drive, sensor_origin="1 0 1.5")
    np.testing.assert_array_equal(moved.poses, as_text.poses)
    T[:3, 3] = 1.0, 0.0, 1.5
    np.testing.assert_allclose(moved.poses, plain.poses @ T, atol=1e-9)
    with pytest.warns(RuntimeWarning, match="1 of 12 scans"):
        shifted = dynains.Recording(drive, pose_shift=1)
    np.testing.assert_array_equal(shifted.poses, plain.poses[1:])


@pytest.mark.parametrize(
    "options, error, text",
    [
        ({"nonsense": 1}, dynains.ConfigError, "unknown parameter nonsense$"),
        ({"pose_units": "km"}, dynains.ConfigError, "pose_units: km: expected m, cm or mm"),
        ({"invert_poses": "yes"}, dynains.ConfigError, "expected true.false"),
        ({"pose_shift": 0.5}, dynains.ConfigError, "pose_shift = 0.5: expected INT"),
        ({"pose_shift": 2000000}, dynains.ConfigError, "expected INT in"),
        ({"time_offset": float("nan")}, dynains.ConfigError, "expected FLOAT in"),
        ({"pose_gap": []}, dynains.ConfigError, "pose_gap = : expected FLOAT"),
        ({"poses": 3}, dynains.IoError, "3"),
        ({"extrinsic": np.zeros((4, 4))}, dynains.PoseError, "a pose|no transform"),
        ({"poses": "nowhere.txt"}, dynains.IoError, "nowhere.txt"),
    ],
)
def test_wrong_options_are_refused(drive, options, error, text):
    with pytest.raises(error, match=text):
        dynains.Recording(drive, **options)
    with pytest.raises(error, match=text):
        dynains.check(drive, **options)


def test_files_that_cannot_be_read_are_os_errors(drive, tmp_path):
    with pytest.raises(OSError, match="nowhere"):
        dynains.Recording(tmp_path / "nowhere")
    with pytest.raises(TypeError):
        dynains.Recording(7)
    scan = tmp_path / "000000.bin"
    scan.write_bytes(bytes(17))
    np.savetxt(tmp_path / "poses.txt", np.eye(4)[:3].reshape(1, 12))
    recording = dynains.Recording(tmp_path)
    with pytest.raises(dynains.IoError, match="000000.bin") as caught:
        recording[0]
    assert isinstance(caught.value, OSError)


def test_scans_without_a_pose_are_told(drive, street, tmp_path):
    poses = tmp_path / "poses.tum"
    rows = [[scan.time, *scan.T_world_sensor[:3, 3], 0, 0, 0, 1] for scan in street[:8]]
    np.savetxt(poses, rows)
    with pytest.warns(RuntimeWarning, match="4 of 12 scans have no pose"):
        recording = dynains.Recording(drive, poses=poses)
    assert len(recording) == 8 and recording.missing_poses == 4
    with pytest.warns(RuntimeWarning, match="4 of 12 scans have no pose"):
        dynains.run(drive, tmp_path / "out", poses=poses, accept_poses=True)


@pytest.fixture(scope="module")
def log(simulate, tmp_path_factory):
    folder = tmp_path_factory.mktemp("log") / "log"
    simulate(folder, "--format", "mcap", "--scans", 12, sensor="hdl64")
    return next(folder.glob("*.mcap"))


def test_a_log_that_is_cut_off(log, tmp_path):
    data = log.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: len(data) * 3 // 4])
    with pytest.warns(RuntimeWarning, match="scans before it are read"):
        recording = dynains.Recording(tmp_path / "cut.mcap")
    assert 0 < len(recording) < 12 and "cut.mcap" in recording.early_end


def test_check_of_a_good_recording(drive):
    recording = dynains.Recording(drive)
    diagnosis = dynains.check(recording)
    assert diagnosis.passed and diagnosis.verdict == "agree" and diagnosis.options == {}
    measured = diagnosis.measured
    assert measured["scans"] == len(recording) and measured["period"] == pytest.approx(0.1)
    assert 0 <= diagnosis.translation_error < 0.1 and 0 <= diagnosis.rotation_error < 1
    assert measured["height"] == pytest.approx(1.2, abs=0.1) and measured["tilt"] < 3
    assert measured["points"] == pytest.approx(np.mean([len(scan.points) for scan in recording]), 0.01)
    text = repr(diagnosis)
    assert text.splitlines()[0].startswith("scans  ") and text.endswith(diagnosis.advice)
    with pytest.raises(TypeError, match="open recording"):
        dynains.check(recording, pose_units="mm")


def test_check_proposes_the_options_of_a_recording(drive):
    given = {"poses": drive / "poses_mm.txt"}
    diagnosis = dynains.check(drive, **given)
    assert not diagnosis.passed and diagnosis.verdict == "otherwise"
    assert diagnosis.options == {**given, "pose_units": "mm"}
    (call,) = [line for line in repr(diagnosis).splitlines() if "dynains.Recording(" in line]
    recording = eval(call.strip(), {"dynains": dynains})
    assert dynains.check(recording).passed
    assert os.fspath(recording.path) == os.fspath(drive)
