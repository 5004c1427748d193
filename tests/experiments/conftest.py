"""Evolutions small enough for tests."""

import pytest

from experiments.config import EvolveConfig


@pytest.fixture(scope="session")
def tiny() -> EvolveConfig:
    """A second in the life of eight robots of two voxels."""
    return EvolveConfig(
        shape="worm-2x1", duration=0.5, population=8, generations=6, threads=1, seed=5
    )
