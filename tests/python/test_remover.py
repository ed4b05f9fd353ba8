import pickle
import threading

import dynains
import numpy as np
import pytest
from dynains import Label


def final_verdicts(scans, points_of=lambda scan: scan.points, **parameters):
    remover = dynains.DynaInsRemover(**parameters)
    verdicts = []
    for scan in scans:
        frame = remover.push(points_of(scan), scan.T_world_sensor, scan.time)
        if frame.finished is not None:
            verdicts.append(frame.finished)
    return verdicts + remover.flush(), remover


def assert_same_verdicts(expected, found):
    assert len(expected) == len(found)
    for a, b in zip(expected, found):
        np.testing.assert_array_equal(a.labels, b.labels)
        np.testing.assert_array_equal(a.instances, b.instances)
        np.testing.assert_array_equal(a.beliefs, b.beliefs)


@pytest.fixture(scope="module")
def verdicts(street):
    return final_verdicts(street)[0]


def test_every_scan_gets_one_final_verdict(street, verdicts):
    assert [verdict.scan for verdict in verdicts] == list(range(len(street)))
    for scan, verdict in zip(street, verdicts):
        count = len(scan.points)
        assert verdict.labels.shape == verdict.instances.shape == verdict.beliefs.shape == (count,)
        assert verdict.labels.dtype == np.uint8
        assert verdict.instances.dtype == np.uint32
        assert verdict.beliefs.dtype == np.float32
        assert verdict.causes.shape == (count,)
        assert verdict.causes.dtype == np.uint8
        assert verdict.objects.shape == (0,)
        assert verdict.time == scan.time
        np.testing.assert_allclose(verdict.T_world_sensor, scan.T_world_sensor, atol=1e-9)
    labels = np.concatenate([verdict.labels for verdict in verdicts])
    assert (labels == Label.DYNAMIC).any()
    assert dynains.is_static(labels).mean() > 0.5


def test_moving_objects_are_an_array_with_named_fields(street):
    found = [verdict.objects for verdict in final_verdicts(street, objects=True)[0]]
    assert found[0].dtype.names[:7] == ("id", "x", "y", "z", "length", "width", "height")
    objects = np.concatenate(found)
    assert len(objects) > 0
    assert (objects["points"] > 0).all()
    assert (objects["first_scan"] <= objects["last_scan"]).all()
    assert (np.hypot(objects["vx"], objects["vy"]) < 60).all()


@pytest.mark.parametrize(
    "points_of",
    [
        lambda scan: scan.points.astype(np.float64),
        lambda scan: np.asfortranarray(scan.points),
        lambda scan: scan.points[:, :3],
        lambda scan: np.repeat(scan.points, 2, axis=0)[::2],
        lambda scan: np.flip(np.ascontiguousarray(np.flip(scan.points, 0)), 0),
        lambda scan: np.flip(np.ascontiguousarray(np.flip(scan.points, 1)), 1),
    ],
    ids=["float64", "column-major", "3 of 4", "every second row", "rows back", "columns back"],
)
def test_labels_do_not_depend_on_type_and_strides(street, verdicts, points_of):
    assert_same_verdicts(verdicts, final_verdicts(street, points_of)[0])


def test_results_outlive_the_next_call_and_the_remover(street):
    remover = dynains.DynaInsRemover()
    first = remover.push(street[0].points, street[0].T_world_sensor, 0.0).newest.labels
    before = first.copy()
    remover.push(np.zeros((len(before), 3)), street[0].T_world_sensor, 0.1)
    points = remover.map_points()
    del remover
    np.testing.assert_array_equal(first, before)
    assert points.shape[1] == 3


def test_the_map_has_the_static_points(street):
    _, remover = final_verdicts(street, map_voxel=0.0)
    points = remover.map_points()
    assert points.dtype == np.float64
    assert points.shape == (remover.map_size, 3)
    kept = []
    for scan, verdict in zip(street, final_verdicts(street)[0]):
        p = scan.points[dynains.is_static(verdict.labels), :3].astype(np.float64)
        kept.append(p @ scan.T_world_sensor[:3, :3].T + scan.T_world_sensor[:3, 3])
    kept = np.concatenate(kept)
    assert len(points) == len(kept)
    np.testing.assert_allclose(np.sort(points, axis=0), np.sort(kept, axis=0), atol=1e-3)


def test_reset_starts_again(street, verdicts):
    _, remover = final_verdicts(street)
    remover.reset()
    assert remover.map_size == 0
    frame = remover.push(street[0].points, street[0].T_world_sensor, 0.0)
    assert frame.newest.scan == 0


def test_a_residual_names_its_scan_and_odd_times_are_doubted(street, identity):
    remover = dynains.DynaInsRemover()
    scans = list(street)
    frames = [remover.push(scan.points, scan.T_world_sensor, scan.time) for scan in scans]
    frame = next(frame for frame in frames if frame.pose_residual is not None)
    assert frame.pose_residual.previous_scan == frame.newest.scan - 1
    assert frame.pose_residual.previous_time == scans[frame.newest.scan - 1].time
    assert frame.pose_residual.T_previous_aligned.shape == (4, 4)
    covariance = frame.pose_residual.covariance
    assert covariance.shape == (6, 6) and np.allclose(covariance, covariance.T)
    assert frame.pose_residual.supported == [
        bool(3 * np.sqrt(covariance[i, i]) * (1 if i < 3 else 10) <= 0.1) for i in range(6)
    ]
    assert all(frame.time_doubt is None for frame in frames)
    assert all(frame.suspicion is None for frame in frames)
    window = frames[-1].plausibility
    assert window["suspicion"] is None and window["since"] == 0 and window["misfits"] == 0
    shares = [window["not_judged"], window["ground_free"], window["instance_free"]]
    assert all(0 <= share < 1 for share in shares) and 0 <= window["residual"] < 0.05
    assert frames[0].pose_residual is None
    assert frames[0].began_epoch is not None and frames[-1].began_epoch is None
    for unit, doubt in [(1e3, "too slow"), (1e-3, "too fast")]:
        remover = dynains.DynaInsRemover()
        for i in range(4):
            frame = remover.push(np.ones((10, 3)), identity, 0.1 * unit * i)
        assert frame.time_doubt == doubt


def test_points_of_another_unit_are_suspicious(street):
    remover = dynains.DynaInsRemover()
    scans = list(street)
    for scan in scans:
        frame = remover.push(1000 * scan.points, scan.T_world_sensor, scan.time)
    assert frame.plausibility["not_judged"] > 0.98
    assert frame.plausibility["suspicion"] == frame.suspicion == "units"


def test_masks_are_not_ignored(identity):
    points = np.ma.masked_array(np.ones((10, 3)), mask=False)
    with pytest.raises(TypeError, match="points are masked: pass points.filled"):
        dynains.DynaInsRemover().push(points, identity)


def test_times_are_optional_and_stages_are_timed(identity):
    remover = dynains.DynaInsRemover()
    for _ in range(3):
        frame = remover.push(np.ones((10, 3), np.float32), identity)
    assert frame.newest.time == pytest.approx(0.2)
    assert {"ingest", "ground", "cluster", "map"} <= set(frame.times)
    assert all(milliseconds >= 0 for milliseconds in frame.times.values())


@pytest.mark.parametrize(
    "points, error, text",
    [
        (np.zeros((3, 2), np.float32), dynains.CloudError, r"shape \(3, 2\)"),
        (np.zeros(9, np.float32), dynains.CloudError, r"shape \(9,\)"),
        (np.zeros((4, 65)), dynains.CloudError, r"shape \(4, 65\), expected \(N, 3\).*transpose"),
        (np.zeros((2, 3, 3)), dynains.CloudError, r"shape \(2, 3, 3\)"),
        ([[1.0, 2.0, 3.0]], TypeError, "^points are list, expected a NumPy array"),
        (None, TypeError, "^points are NoneType, expected a NumPy array"),
        (np.zeros((3, 3), np.int32), TypeError, "points are int32"),
        (np.zeros((3, 3), ">f4"), TypeError, "points are >f4"),
    ],
)
def test_bad_arrays_are_refused(identity, points, error, text):
    with pytest.raises(error, match=text):
        dynains.DynaInsRemover().push(points, identity)


@pytest.mark.parametrize(
    "pose, text",
    [
        (np.eye(3), r"shape \(3, 3\)"),
        (2 * np.eye(4), "is no transform"),
        (np.diag([1.0, 1, -1, 1]), "is not rigid"),
        (np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [1, 2, 3, 1]]), "column-major"),
    ],
)
def test_bad_poses_are_refused_and_change_nothing(pose, text):
    remover = dynains.DynaInsRemover()
    with pytest.raises(dynains.PoseError, match=text):
        remover.push(np.ones((5, 3)), pose)
    assert remover.push(np.ones((5, 3)), np.eye(4)).newest.scan == 0


def test_a_point_may_have_many_columns(identity):
    for shape in (4, 3), (4, 4), (4, 10), (4, 64), (0, 3):
        points = np.ones(shape, np.float32)
        assert dynains.DynaInsRemover().push(points, identity).newest.labels.shape == shape[:1]


def test_poses_may_be_lists_but_nothing_else_than_numbers():
    remover = dynains.DynaInsRemover()
    remover.push(np.ones((5, 3)), np.eye(4).tolist())
    for pose in "north", [[1, 0], [0]]:
        with pytest.raises(TypeError, match=r"^a pose is (str|list), expected \(4, 4\) numbers"):
            remover.push(np.ones((5, 3)), pose)


def test_points_of_several_sensors(street):
    config = dynains.Config()
    behind = np.eye(4)
    behind[0, 3] = -1.0
    config.sensors = [np.eye(4), behind]
    assert config != dynains.Config()
    assert pickle.loads(pickle.dumps(config)) == config
    remover = dynains.DynaInsRemover(config)
    points = street[0].points
    sensors = np.arange(len(points)) % 2
    frame = remover.push(points, street[0].T_world_sensor, sensors=sensors)
    assert frame.newest.labels.shape == (len(points),)
    assert frame.newest.epoch > 0
    np.testing.assert_allclose(frame.newest.T_world_compared, street[0].T_world_sensor)
    for wrong in sensors + 1, sensors[1:]:
        with pytest.raises(dynains.CloudError):
            remover.push(points, street[1].T_world_sensor, sensors=wrong)
    behind[0, 0] = 2.0
    with pytest.raises(dynains.ConfigError, match=r"sensors\[1\]"):
        config.sensors = [np.eye(4), behind]


def test_push_lets_other_threads_run(street, no_switching):
    remover = dynains.DynaInsRemover()
    started, ran = threading.Event(), []
    thread = threading.Thread(target=lambda: (started.wait(), ran.append(1)))
    thread.start()
    started.set()
    for scan in 100 * street:  # a busy machine may need several scans
        remover.push(scan.points, scan.T_world_sensor)
        if ran:
            break
    assert ran
    thread.join()


def test_removers_in_threads_and_one_shared(street, verdicts):
    """Removers in threads of their own give what they give alone; one shared stays whole."""
    shared = dynains.DynaInsRemover()
    found = {}

    def work(name):
        found[name] = final_verdicts(street)[0]
        for scan in street:
            shared.push(scan.points, scan.T_world_sensor)

    threads = [threading.Thread(target=work, args=(name,)) for name in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for name in range(3):
        assert_same_verdicts(verdicts, found[name])
    next_scan = shared.push(street[0].points, street[0].T_world_sensor).newest.scan
    assert next_scan == 3 * len(street)
