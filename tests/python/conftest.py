import os
import subprocess
import sys

import dynains
import numpy as np
import pytest


def run_simulator(folder, *words, sensor="vlp16"):
    """A recording by dynains_simulate."""
    command = [os.environ["DYNAINS_PROGRAM"] + "_simulate", folder, "-q", "--sensor", sensor]
    subprocess.run([*command, *map(str, words)], check=True)
    return folder


@pytest.fixture(scope="session")
def simulate():
    return run_simulator


@pytest.fixture(scope="session")
def street(tmp_path_factory):
    """Twelve scans of a small simulated street with traffic."""
    folder = tmp_path_factory.mktemp("simulated") / "street"
    words = "--labelling", "instant", "--scans", 12, "--seed", 3
    return list(dynains.Recording(run_simulator(folder, *words)))


@pytest.fixture
def identity():
    return np.eye(4)


@pytest.fixture
def no_switching():
    """Other threads run only if a call releases the lock of Python."""
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1000)
    yield
    sys.setswitchinterval(interval)


@pytest.fixture(scope="session")
def drive(street, tmp_path_factory):
    """The street as a folder in the format of SemanticKITTI; its poses also in mm."""
    folder = tmp_path_factory.mktemp("recordings") / "drive"
    for name in "velodyne", "labels":
        (folder / name).mkdir(parents=True)
    for i, scan in enumerate(street):
        scan.points.tofile(folder / f"velodyne/{i:06}.bin")
        scan.labels.tofile(folder / f"labels/{i:06}.label")
    poses = np.array([scan.T_world_sensor[:3] for scan in street])
    np.savetxt(folder / "times.txt", [scan.time for scan in street])
    np.savetxt(folder / "poses.txt", poses.reshape(-1, 12))
    poses[:, :, 3] *= 1000
    np.savetxt(folder / "poses_mm.txt", poses.reshape(-1, 12))
    return folder
