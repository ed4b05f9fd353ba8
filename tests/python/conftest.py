import dynains
import numpy as np
import pytest


@pytest.fixture(scope="session")
def street():
    """Twelve scans of a small simulated street with traffic."""
    simulator = dynains.Simulator("urban", "vlp16", labelling="instant", scans=12, seed=3)
    return [simulator[i] for i in range(len(simulator))]


@pytest.fixture
def identity():
    return np.eye(4)
