import dynains
import numpy as np
import pytest
from dynains import Label

SENSOR_HEIGHT = 1.8  # m


def measure(y, has_van):
    """Scan from (0, y) of a street between walls with a pier of 2 m every 10 m, and which points
    are on the van at x = 3."""
    elevation, azimuth = np.meshgrid(np.arange(-0.4, 0.2, 0.02), np.arange(-3.14, 3.14, 0.01))
    dx = np.cos(elevation) * np.cos(azimuth)
    dy = np.cos(elevation) * np.sin(azimuth)
    dz = np.sin(elevation)
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.where(np.abs(dx) > 0.1, 8.0 / np.abs(dx), np.inf)
        distance = np.where(dz < 0, np.minimum(distance, -SENSOR_HEIGHT / dz), distance)
        for pier in np.arange(-100, 181, 10):
            at_pier = (pier - y) / dy
            is_hit = (at_pier > 0) & (at_pier < distance) & (np.abs(at_pier * dx) > 6)
            distance = np.where(is_hit, at_pier, distance)
        at_van = np.where(dx > 0.05, 3.0 / dx, np.inf)
    with np.errstate(invalid="ignore"):
        is_van = (at_van < distance) & (np.abs(y + at_van * dy) < 2.5)
        is_van &= (SENSOR_HEIGHT + at_van * dz < 2.2) & has_van
    distance = np.where(is_van, at_van, distance)
    is_near = distance < 60
    points = (distance[..., None] * np.stack([dx, dy, dz], axis=-1))[is_near]
    T_world_sensor = np.eye(4)
    T_world_sensor[:3, 3] = 0, y, SENSOR_HEIGHT
    return points, is_van[is_near], T_world_sensor


@pytest.fixture(scope="module")
def drive():
    """Past the van, 80 m on, and back: then it is gone."""
    scans = [measure(30 - 50 * np.cos(np.pi * i / 100), i < 100) for i in range(201)]
    remover = dynains.DynaInsRemover(build_map=False)
    verdicts = []
    for i, (points, _, T_world_sensor) in enumerate(scans):
        frame = remover.push(points, T_world_sensor, 0.1 * i)
        if frame.finished is not None:
            verdicts.append(frame.finished)
    return scans, verdicts + remover.flush()


def moving_share(scans, verdicts):
    of_van = [v.labels[is_van] for (_, is_van, _), v in zip(scans, verdicts)]
    return (np.concatenate(of_van) == Label.DYNAMIC).mean()


@pytest.mark.parametrize("static", ["always", "last"])
def test_all_scans_remove_what_left_later(drive, static):
    scans, first = drive
    second_pass = dynains.SecondPass(static=static, threads=2)
    for (points, _, _), verdict in zip(scans, first):
        second_pass.add(points, verdict)
    second_pass.test()
    revised = [second_pass.revise(points, v) for (points, _, _), v in zip(scans, first)]
    assert moving_share(scans, first) < 0.5
    assert moving_share(scans, revised) > 0.9
    became_moving = sum(
        int(((after.labels == Label.DYNAMIC) & (before.labels != Label.DYNAMIC)).sum())
        for before, after in zip(first, revised)
    )
    assert became_moving == second_pass.removed
    assert [v.scan for v in revised] == [v.scan for v in first]


def test_wrong_calls_say_what_is_wrong(drive):
    scans, verdicts = drive
    with pytest.raises(dynains.ConfigError, match="'sometimes', expected 'always' or 'last'"):
        dynains.SecondPass(static="sometimes")
    with pytest.raises(dynains.ConfigError, match="threads"):
        dynains.SecondPass(threads=3)
    second_pass = dynains.SecondPass()
    with pytest.raises(dynains.UsageError, match="scan 1, expected scan 0"):
        second_pass.add(scans[1][0], verdicts[1])
    with pytest.raises(dynains.UsageError, match="points"):
        second_pass.add(scans[0][0][1:], verdicts[0])
