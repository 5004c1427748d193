"""The simulator on quadrants, the maintained fork of Taichi, and the setting that chooses it."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

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

RECORDED = """
from tests.physics.engine.test_recorded_bits import closed_loop, load

record = load()
assert closed_loop(record, "worm-4x1", "default", "float32") == record["closed"]["worm-4x1 float32"]
"""
needs_quadrants = pytest.mark.skipif(
    not importlib.util.find_spec("quadrants"), reason="needs quadrants"
)


def run(code: str, backend: str) -> subprocess.CompletedProcess[str]:
    """Python code in a process with a backend."""
    return subprocess.run(
        [sys.executable, "-c", code],
        cwd=Path(__file__).parents[3],
        env={**os.environ, "HEBBTORCH_BACKEND": backend},
        capture_output=True,
        text=True,
    )


@pytest.mark.slow
@needs_quadrants
def test_quadrants_gives_the_bits_of_taichi() -> None:
    theirs, ours = run(GAIT, "quadrants"), run(GAIT, "taichi")
    assert theirs.returncode == 0, theirs.stderr
    assert theirs.stdout == ours.stdout


@pytest.mark.slow
@needs_quadrants
def test_networks_in_the_kernel_are_as_recorded() -> None:
    ended = run(RECORDED, "quadrants")
    assert ended.returncode == 0, ended.stderr


def test_other_backends_are_refused() -> None:
    ended = run("import physics", "numba")
    assert ended.returncode == 1
    assert "HEBBTORCH_BACKEND: expected taichi or quadrants, got 'numba'" in ended.stderr
