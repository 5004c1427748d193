"""The simulator on a GPU beside itself on the CPU; skipped where PyTorch finds no GPU.

The scalar program that a GPU runs is also checked without one: as ``lanes=1``, in test_batch, and
compiled for CUDA, in tests/gpu.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
import torch

from physics import Simulator

needs_gpu = pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")

# A process simulates on one device, so each has one of its own. It prints nothing and saves the
# way of the centres of mass in the first second, (steps, gaits, 2), and speeds over 20 s, (gaits,).
_OPEN_LOOP = """
import sys, torch
from physics import Simulator, Terrain
from tests.physics.worlds import gaits
device, file = sys.argv[1:]
terrains = [Terrain.from_name(f"hilly-3-30-{seed % 20}") for seed in range(100)]
sim = Simulator("worm-7x1", terrains, 100, sensors="high", device=device, dtype=torch.float32)
actuations, way = gaits(1200, 100, 7), []
for actuation in actuations[:60]:
    readings = sim.step(actuation)
    way.append(sim.center_of_mass())
sim.run(actuations[60:])
speeds = (sim.center_of_mass() - way[-1])[:, 0] / 19
assert readings.device.type == way[0].device.type == device
torch.save((torch.stack(way).cpu(), speeds.cpu()), file)
"""
_CLOSED_LOOP = """
import sys, torch
from experiments.rollout import controller, evaluate, seeds
from experiments.config import EvolveConfig
device, file = sys.argv[1:]
found = []
for duration in (0.33, 1.0):
    config = EvolveConfig(
        sensors="high", duration=duration, device=device, runs=1, population=40
    )
    evaluator = evaluate.Evaluator(config)
    draws = torch.Generator().manual_seed(1)
    genomes = torch.rand(1, 40, evaluator.n_genes, generator=draws) * 2 - 1
    life = evaluator(genomes.to(device), 1)
    assert life.state.weights[0].device.type == device
    found += [life.speed.cpu(), life.state.weights[0].cpu()]
torch.save(found, file)
"""


_CARD = SimpleNamespace(multi_processor_count=132)


def on(device: str, script: str, folder: Path) -> tuple[torch.Tensor, ...]:
    """What a script saves on a device."""
    file = folder / device
    subprocess.run(
        [sys.executable, "-c", script, device, str(file)],
        check=True,
        cwd=Path(__file__).parents[2],
    )
    return torch.load(file, weights_only=True)


@needs_gpu
def test_a_gpu_follows_the_cpu(tmp_path: Path) -> None:
    """Until chaos parts them: the CPU parts as fast from itself moved by one unit of rounding."""
    (way, speeds), (their_way, their_speeds) = (
        on(device, _OPEN_LOOP, tmp_path) for device in ("cuda", "cpu")
    )
    apart = (way - their_way).norm(dim=-1)
    assert apart[:20].max() < 1e-4
    assert apart[:60].median(1).values.max() < 1e-4
    for change in (speeds - their_speeds, speeds.abs() - their_speeds.abs()):
        assert change.mean().abs() < 3 * change.std() / len(change) ** 0.5


@needs_gpu
def test_a_gpu_computes_the_same_in_double_precision(tmp_path: Path) -> None:
    (way, _), (their_way, _) = (
        on(device, _OPEN_LOOP.replace("float32", "float64"), tmp_path) for device in ("cuda", "cpu")
    )
    assert (way - their_way)[:30].abs().max() < 1e-9


@needs_gpu
def test_the_closed_loop_on_a_gpu_follows_that_on_the_cpu(tmp_path: Path) -> None:
    """As far as the CPU follows itself moved by one unit of rounding: there, speeds part
    by 6e-6 m/s within 20 steps, and within a second by 1e-5 in the median and by 1e-2 at most."""
    ours, theirs = (on(device, _CLOSED_LOOP, tmp_path) for device in ("cuda", "cpu"))
    speed, weights, later_speed, later_weights = (
        (our - their).abs() for our, their in zip(ours, theirs, strict=True)
    )
    assert speed.max() < 1e-4
    assert weights.max() < 1e-4
    assert later_speed.median() < 1e-4
    assert later_weights.flatten(1).amax(1).median() < 1e-4


@pytest.mark.skipif(torch.cuda.is_available(), reason="needs a machine without a GPU")
def test_without_a_gpu_it_is_refused() -> None:
    with pytest.raises(ValueError, match="PyTorch finds no GPU here, got 'cuda'"):
        Simulator("box-1x1", None, device="cuda")


@pytest.mark.skipif(torch.cuda.is_available(), reason="needs a machine without a GPU")
def test_taichi_does_not_fall_back_to_the_cpu_unnoticed() -> None:
    """PyTorch may find a GPU whose driver Taichi cannot use."""
    script = """
from physics import backend
try:
    backend.start("cuda")
except ValueError as error:
    print(error)
backend.start("cpu")  # still can
"""
    done = subprocess.run(
        [sys.executable, "-c", script],
        check=True,
        capture_output=True,
        text=True,
        cwd=Path(__file__).parents[2],
    )
    assert done.stdout.splitlines()[-1].startswith('device: expected "cpu", for Taichi finds no')


def test_a_process_simulates_on_one_device(monkeypatch: pytest.MonkeyPatch) -> None:
    Simulator("box-1x1", None)
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    monkeypatch.setattr(torch.cuda, "current_device", lambda: 0)
    monkeypatch.setattr(torch.cuda, "get_device_properties", lambda _: _CARD)
    with pytest.raises(ValueError, match="expected cpu, on which this process simulates already"):
        Simulator("box-1x1", None, device="cuda")
    with pytest.raises(ValueError, match="lanes: expected 1 on a GPU, got 8"):
        Simulator("box-1x1", None, device="cuda:0", lanes=8)


@pytest.mark.parametrize("device", ["cuda:1", "cuda"])
def test_taichi_uses_the_first_gpu_alone(monkeypatch: pytest.MonkeyPatch, device: str) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    monkeypatch.setattr(torch.cuda, "current_device", lambda: 1)
    with pytest.raises(ValueError, match=f"expected .cuda:0., .* got '{device}' which is cuda:1"):
        Simulator("box-1x1", None, device=device)
