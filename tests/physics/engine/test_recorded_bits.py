"""The engine's results, bit for bit as they were recorded.

Whatever enters them is exact on every machine: the terrains are tables, the actuations triangular
waves of binary fractions, the genomes integers over a power of two. Kernels round as IEEE says.
Only tanh in float64 is the platform's, so those closed loops are compared after rounding.

``python -m tests.physics.engine.test_recorded_bits`` records anew, after a change of the engine
that is meant to change its results.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

import hebbtorch
from experiments.rollout.control_loop import Loop, control_loop
from physics import Engine, Simulator, Terrain

RECORD = Path(__file__).with_name("recorded_bits.json")
SHAPES = ("worm-4x1", "biped-4x3", "tripod-5x3", "box-2x2", "comb-5x2", "T-3x3")
ENGINES = {
    "default": Engine(),
    "no self-collision": Engine(self_collision=False),
    "continuous": Engine(continuous=True),
}
DTYPES = {"float32": torch.float32, "float64": torch.float64}
OPEN = [(shape, engine, dtype) for shape in SHAPES for engine in ENGINES for dtype in DTYPES]
SLOW = [  # programs that few others need, and that take seconds to compile
    ("no self-collision", "float64"),
    ("continuous", "float32"),
    ("continuous", "float64"),
]
CLOSED = [(shape, "default", dtype) for shape in ("biped-4x3", "worm-4x1") for dtype in DTYPES]
THROUGH_TORCH = ("biped-4x3", "worm-4x1")
WORLDS = 5
STEPS = 100
TORCH_STEPS = 20  # in float64 two orders of a sum are 1e-12 apart then, after 60 steps 0.1
GRID = 2.0**16  # of what is compared after rounding, per unit


def terrains(record: dict[str, Any]) -> list[Terrain]:
    """The grounds of the worlds: level, three of hills, one of steps."""
    profiles = [(np.array(each) / 1024).T for each in record["grounds"]]
    return [Terrain.from_profile(xs, ys) for xs, ys in profiles]


def waves(voxels: int) -> Tensor:
    """Triangular waves of full amplitude, (STEPS, WORLDS, voxels)."""
    t = torch.arange(STEPS)[:, None, None]
    world, voxel = torch.arange(WORLDS)[:, None], torch.arange(voxels)
    phase = (t * (2 + world) + 37 * voxel + 11 * world) % 128
    return ((phase - 64).abs() - 32).double() / 32


def digest(sim: Simulator, grid: float | None = None) -> str:
    """Of the poses and velocities of all squares and of the touched voxels."""
    parts = [sim.mass_poses(), sim.mass_velocities(), sim.touching().to(sim.dtype)]
    content = b"".join(
        (part if grid is None else (part * grid).round() + 0.0).contiguous().numpy().tobytes()
        for part in parts
    )
    return hashlib.sha256(content).hexdigest()[:16]


def open_loop(record: dict[str, Any], shape: str, engine: str, dtype: str) -> str:
    sim = Simulator(
        shape, terrains(record), WORLDS, dtype=DTYPES[dtype], engine=ENGINES[engine], threads=1
    )
    sim.run(waves(sim.n_voxels))
    return digest(sim)


def closed_loop(
    record: dict[str, Any],
    shape: str,
    engine: str,
    dtype: str,
    loop: Loop = "fused",
    steps: int = STEPS,
) -> str:
    """Hebbian networks with readings of every kind."""
    sim = Simulator(
        shape,
        terrains(record),
        WORLDS,
        sensors="high",
        dtype=DTYPES[dtype],
        engine=ENGINES[engine],
        threads=1,
    )
    sizes = [sim.n_readings, 6, sim.n_voxels]
    net = hebbtorch.HebbianMLP(sizes, eta=0.0625, population=(WORLDS,)).to(sim.dtype)
    numbers = torch.arange(WORLDS * net.n_genes).reshape(WORLDS, -1)
    net.set_genomes(((numbers * 7919) % 257 - 128).to(sim.dtype) / 32)
    control_loop(sim, net, net.initial_state(), loop).run(sim, steps)
    return digest(sim, GRID if dtype == "float64" else None)


def load() -> dict[str, Any]:
    record: dict[str, Any] = json.loads(RECORD.read_text())
    return record


@pytest.mark.parametrize(
    ("shape", "engine", "dtype"),
    [pytest.param(*each, marks=pytest.mark.long if each[1:] in SLOW else ()) for each in OPEN],
)
def test_an_open_loop_is_as_recorded(shape, engine, dtype):
    record = load()
    assert open_loop(record, shape, engine, dtype) == record["open"][f"{shape} {engine} {dtype}"]


@pytest.mark.parametrize(("shape", "engine", "dtype"), CLOSED)
def test_a_closed_loop_is_as_recorded(shape, engine, dtype):
    record = load()
    assert closed_loop(record, shape, engine, dtype) == record["closed"][f"{shape} {dtype}"]


@pytest.mark.parametrize("loop", ["torch", "fused"])
@pytest.mark.parametrize("shape", THROUGH_TORCH)
def test_a_loop_through_torch_is_as_recorded(shape, loop):
    """PyTorch sums in an order of its own, another on other processors: what is recorded is short,
    in float64 and rounded, so that the order does not show."""
    record = load()
    found = closed_loop(record, shape, "default", "float64", loop, TORCH_STEPS)
    assert found == record["through torch"][shape]


def test_single_steps_are_as_recorded():
    record = load()
    sim = Simulator("biped-4x3", terrains(record), WORLDS, threads=1)
    for actuation in waves(sim.n_voxels):
        sim.step(actuation)
    assert digest(sim) == record["open"]["biped-4x3 default float32"]


def test_lone_worlds_are_as_recorded():
    """Each world in a simulator of its own gives what it gave beside the others."""
    record = load()
    grounds = terrains(record)
    sim = Simulator("worm-4x1", grounds, WORLDS, threads=1)
    actuations = waves(sim.n_voxels)
    sim.run(actuations)
    assert digest(sim) == record["open"]["worm-4x1 default float32"]
    for world in (0, 4):
        alone = Simulator("worm-4x1", grounds[world], threads=1)
        alone.run(actuations[:, world : world + 1])
        assert torch.equal(alone.mass_poses()[0], sim.mass_poses()[world])


def write_record() -> None:
    """Writes the record of the present engine; the grounds, once written, stay."""
    names = ("flat", "hilly-3-30-0", "hilly-3-30-7", "hilly-1-3-3", "steppy-1-3-3")
    if RECORD.exists():
        grounds = load()["grounds"]
    else:
        grounds = []
        for name in names:
            terrain = Terrain.from_name(name)
            points = np.stack([terrain.xs, terrain.ys], 1)[:16]
            grounds.append(np.round(points * 1024).astype(int).tolist())
    record: dict[str, Any] = {"grounds": grounds}
    record["open"] = {" ".join(each): open_loop(record, *each) for each in OPEN}
    record["closed"] = {f"{e[0]} {e[2]}": closed_loop(record, *e) for e in CLOSED}
    record["through torch"] = {
        shape: closed_loop(record, shape, "default", "float64", "torch", TORCH_STEPS)
        for shape in THROUGH_TORCH
    }
    RECORD.write_text(json.dumps(record) + "\n")


if __name__ == "__main__":
    write_record()
