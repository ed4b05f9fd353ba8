import math

import dynains
import numpy as np
import pytest

# Four points in four voxels: two static, two dynamic; 10 m ahead of the sensor.
POINTS = np.array([[10, 0, 0], [10, 2, 0], [10, 4, 0], [10, 6, 0]], np.float32)
MOVES = np.array([False, False, True, True])


def score(kept, truth=MOVES, **settings):
    rows = dynains.evaluate([POINTS], [np.eye(4)], [truth], [np.array(kept)], **settings)
    return rows["estimate"]


def test_scores_worked_by_hand():
    perfect = score([True, True, False, False])
    assert (perfect["PR"], perfect["RR"], perfect["F1"]) == (100, 100, 1)
    assert (perfect["SA"], perfect["DA"], perfect["AA"], perfect["HA"]) == (100, 100, 100, 100)
    half = score([True, False, False, True])
    assert (half["PR"], half["RR"], half["F1"]) == (50, 50, 0.5)
    most = score([True, True, False, True])
    assert (most["PR"], most["RR"]) == (100, 50)
    assert most["F1"] == pytest.approx(2 * 1.0 * 0.5 / 1.5)
    assert most["AA"] == pytest.approx(math.sqrt(100 * 50))


def test_truth_is_flags_or_labels():
    labels = np.array([40, 50 | 7 << 16, 252 | 3 << 16, 259], np.uint32)
    kept = [True, False, True, False]
    expected = pytest.approx(score(kept), nan_ok=True)  # NaN: kept and left without objects
    assert score(kept, labels) == expected
    assert score(kept, labels.tolist()) == expected
    assert score(kept, MOVES.tolist()) == expected
    # Without class 259 the last point is static, and is lost.
    assert score(kept, labels, dynamic_classes="252-258")["PR"] == pytest.approx(100 / 3)


@pytest.mark.parametrize(
    "arguments, settings, error, text",
    [
        (([POINTS], [np.eye(4)], [MOVES], []), {}, ValueError, "as many scans"),
        (([POINTS], [np.eye(4)], [MOVES[:3]], [MOVES]), {}, ValueError, r"truth of scan 0.*\(3,\)"),
        (([POINTS], [np.eye(4)], [MOVES], [MOVES[:1]]), {}, ValueError, "kept of scan 0"),
        (([POINTS[0]], [np.eye(4)], [MOVES], [MOVES]), {}, dynains.CloudError, "points of scan 0"),
        (([np.ones((3, 99))], [np.eye(4)], [MOVES], [MOVES]), {}, dynains.CloudError, "transpose"),
        (([[[1, 2, 3], [1]]], [np.eye(4)], [MOVES], [MOVES]), {}, TypeError, "points of scan 0"),
        (([POINTS], [np.eye(3)], [MOVES], [MOVES]), {}, dynains.PoseError, "shape"),
        (([POINTS], ["north"], [MOVES], [MOVES]), {}, TypeError, "a pose is str"),
        # Raw labels in place of the result of is_static(); invalid classes.
        (([POINTS], [np.eye(4)], [MOVES], [np.uint8([3, 3, 4, 4])]), {}, TypeError, "is_static"),
        (([POINTS], [np.eye(4)], [MOVES], [[1.0, 0.5, 0, 0]]), {}, TypeError, "kept of scan 0"),
        (([POINTS], [np.eye(4)], [[40, 40, -1, 252]], [MOVES]), {}, TypeError, "truth of scan 0"),
        (([POINTS], [np.eye(4)], [[40, 40, 2**32 + 252, 252]], [MOVES]), {}, TypeError, "32 bits"),
        (([POINTS], [np.eye(4)], [MOVES], [MOVES]), {"voxel": 0}, dynains.ConfigError, "voxel = 0"),
        (([POINTS], [np.eye(4)], [MOVES], [MOVES]), {"vxl": 1}, dynains.ConfigError, "vxl"),
        (([POINTS], [np.eye(4)], [MOVES], [MOVES]), {"unlabeled": "x"}, dynains.ConfigError, "'x'"),
    ],
)
def test_bad_input_is_refused(arguments, settings, error, text):
    with pytest.raises(error, match=text):
        dynains.evaluate(*arguments, **settings)
