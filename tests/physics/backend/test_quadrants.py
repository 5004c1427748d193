"""The simulator on quadrants, the maintained fork of Taichi, and the setting that chooses it."""

import importlib.util
import os
import subprocess
import sys

import pytest

GAIT = """
import torch
import physics

sim = physics.Simulator("worm-3x1", physics.Terrain.from_name("hilly-3-30-0"), 8, sensors="high",
    noise=0.05, threads=1, lanes=8, engine=physics.Engine(continuous=True))
draws = torch.Generator().manual_seed(1)
readings = sim.run(2 * torch.rand(120, 8, 3, generator=draws) - 1)
print(sim.mass_poses().flatten().tolist(), readings.flatten().tolist())
"""


def gait(backend: str) -> subprocess.CompletedProcess[str]:
    """A process that prints the end of a gait."""
    return subprocess.run(
        [sys.executable, "-c", GAIT],
        env={**os.environ, "HEBBTORCH_BACKEND": backend},
        capture_output=True,
        text=True,
    )


@pytest.mark.slow
@pytest.mark.skipif(not importlib.util.find_spec("quadrants"), reason="needs quadrants")
def test_quadrants_gives_the_bits_of_taichi() -> None:
    theirs, ours = gait("quadrants"), gait("taichi")
    assert theirs.returncode == 0, theirs.stderr
    assert theirs.stdout == ours.stdout


def test_other_backends_are_refused() -> None:
    ended = gait("numba")
    assert ended.returncode == 1
    assert "HEBBTORCH_BACKEND: expected taichi or quadrants, got 'numba'" in ended.stderr
