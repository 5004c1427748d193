"""The GPU's program on a stand-in for CUDA's driver, beside the CPU's."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import torch
from torch import Tensor

from tests.gpu import episodes
from tests.gpu.pretend import Pretend

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        torch.cuda.is_available(), reason="has a GPU: tests/physics/test_gpu.py looks at that one"
    ),
]

_Results = tuple[dict[str, Any], dict[str, Tensor]]


def both(precision: str, folder: Path) -> _Results:
    """What the episodes give on the stand-in, in a process of its own, and on the CPU meanwhile."""
    file = folder / f"{precision}.pt"
    paths = [str(folder), os.environ.get("LD_LIBRARY_PATH", "")]
    with subprocess.Popen(
        [sys.executable, "-m", "tests.gpu.episodes", precision, str(folder), str(file)],
        env={**os.environ, "LD_LIBRARY_PATH": os.pathsep.join(filter(None, paths))},
        cwd=Path(__file__).parents[2],
    ) as process:
        on_cpu = getattr(episodes, precision)("cpu")
    assert process.returncode == 0
    return torch.load(file, weights_only=True), on_cpu


@pytest.fixture(scope="module")
def single(folder: Path) -> _Results:
    return both("single", folder)


@pytest.fixture(scope="module")
def double(folder: Path) -> _Results:
    return both("double", folder)


def apart(results: _Results, name: str) -> float:
    """The largest difference."""
    ours, theirs = (each[name] for each in results)
    assert ours.shape == theirs.shape
    assert ours.isfinite().all()
    return (ours - theirs).abs().max().item()


@pytest.mark.parametrize("shape", ["worm-7x1", "biped-4x3"])
def test_gaits_in_double_precision(double: _Results, shape: str) -> None:
    """With self-collision and continuous detection, both of which change these bipeds' ways."""
    assert double[0]["launches"] > 50  # none would mean that Taichi took the CPU
    assert apart(double, shape) < 1e-9
    assert apart(double, f"readings of {shape}") < 1e-9


def test_gaits_in_single_precision(single: _Results) -> None:
    assert single[0]["launches"] > 20
    assert apart(single, "worm-7x1") < 1e-4


def test_environments_that_are_reset_in_different_steps(single: _Results) -> None:
    assert apart(single, "observations") < 1e-3
    assert apart(single, "centers") < 1e-4


def test_the_closed_loop(single: _Results) -> None:
    assert apart(single, "speeds") < 1e-4
    assert apart(single, "weights") < 1e-3


def test_every_one_of_very_many_worlds_makes_its_step(single: _Results) -> None:
    steps, squares = (single[0][name] for name in ("steps", "squares"))
    assert steps.shape == (episodes.MANY,)
    assert (steps == 1).all()
    assert (squares[1:] != squares[:-1]).flatten(1).any(
        1
    ).sum() > 0.9 * episodes.MANY  # each its own
    assert apart(single, "squares") < 1e-5


def named(calls: list[str], *parts: str) -> list[str]:
    return [call for call in calls if any(part in call for part in parts)]


def test_a_run_copies_no_array_and_never_waits(single: _Results) -> None:
    calls = single[0]["calls"]["gpu"]
    (copy,) = named(calls, "cuMemcpy")
    name, size = copy.split()
    assert name == "cuMemcpyHtoDAsync_v2"
    assert int(size) < 256  # the arguments
    assert len(named(calls, "cuLaunchKernel")) == 2  # one finds the number of threads
    assert not named(calls, "Synchronize", "torch")


def test_copies_and_waits_are_seen(single: _Results) -> None:
    calls = single[0]["calls"]
    assert named(calls["host"], "torch copies")
    array = str(3 * 40 * 7 * 4)  # the actuations
    assert len([call for call in named(calls["host, unmoved"], "cuMemcpy") if array in call]) == 2
    assert named(calls["host, unmoved"], "cuStreamSynchronize")


def test_tensors_pretend_to_lie_on_a_gpu() -> None:
    notes: list[str] = []
    with Pretend(notes.append):
        here, there = torch.ones(3), torch.ones(3, device="cuda")
        assert (2 * there[:2]).device.type == torch.zeros_like(there).device.type == "cuda"
        assert torch.nn.Linear(2, 2).to("cuda").weight.device.type == "cuda"
        for mixed in (lambda: here + there, lambda: here[there > 0], lambda: here @ there):
            with pytest.raises(RuntimeError, match="on the same device"):
                mixed()
        with pytest.raises(TypeError, match="numpy"):
            there.numpy()
        notes.clear()
        back = there.to("cpu").add_(1)
        assert back.device.type == "cpu"
        assert there.sum().item() == 3  # untouched by what was done to the copy
        there[0] = here[0]
        there[1:].copy_(here[1:])
    assert notes == ["torch copies to", "torch waits item", "torch copies copy_"]
