"""Trajectories are those of an earlier version, bit for bit: shapes x engines x loops x precisions.

The hashes in `tests/recorded/trajectories.json` were made before the modules were moved. They hold
wherever arithmetic is IEEE's; those of the loop through PyTorch hold for its version and vector
instructions, since its tanh and its sums are its own.
"""

import json
from hashlib import blake2b
from pathlib import Path
from typing import Any

import pytest
import torch
from torch import Tensor

import hebbtorch
from experiments.rollout.control_loop import Loop, control_loop
from physics import Damage, Engine, Simulator, Terrain

RECORDED = json.loads((Path(__file__).parents[2] / "recorded" / "trajectories.json").read_text())
SHAPES = ("worm-7x1", "biped-4x3", "comb-7x2", "tripod-5x3", "ball-4", "T-3x3")
ENGINES: dict[str, dict[str, Any]] = {
    "plain": {"self_collision": False},
    "self-collision": {"self_collision": True},
    "continuous": {"self_collision": False, "continuous": True},
    "both": {"self_collision": True, "continuous": True},
}
STEPS, WORLDS = 90, 3

SAME_TORCH = (RECORDED["torch"], RECORDED["cpu"]) == (
    torch.__version__.split("+")[0],
    torch.backends.cpu.get_cpu_capability(),
)


def digest(*tensors: Tensor) -> str:
    content = b"".join(tensor.contiguous().numpy().tobytes() for tensor in tensors)
    return blake2b(content, digest_size=8).hexdigest()


def worlds(shape: str, engine: str, dtype: torch.dtype) -> Simulator:
    terrains = [Terrain.from_name(name) for name in ("hilly-3-10-7", "steppy-1-10-3", "flat")]
    return Simulator(
        shape,
        terrains,
        WORLDS,
        sensors="high",
        noise=0.01,
        dtype=dtype,
        seed=[3, 4, 5],
        engine=Engine(**ENGINES[engine]),
        damage=Damage(0.5, time=1.0),
        threads=1,
    )


def open_loop(sim: Simulator) -> str:
    """A triangle wave of each voxel's own phase, which takes no library's sine."""
    time = torch.arange(STEPS, dtype=torch.float64)[:, None, None] / 60
    place = torch.arange(WORLDS * sim.n_voxels, dtype=torch.float64).reshape(WORLDS, -1)
    phase = (1.5 * time + 0.37 * place) % 1.0
    sim.run((4 * (phase - 0.5).abs() - 1).to(sim.dtype))
    return digest(sim.mass_poses(), sim.mass_velocities(), sim.readings())


def closed_loop(sim: Simulator, loop: Loop) -> str:
    """Random rules from integers, the same on every machine."""
    n = sim.n_readings
    network = hebbtorch.HebbianMLP([n, n, sim.n_voxels], population=(WORLDS,)).to(sim.dtype)
    draws = torch.Generator().manual_seed(1)
    genomes = torch.randint(-1000, 1000, (WORLDS, network.n_genes), generator=draws) / 500
    network.set_genomes(genomes.to(sim.dtype))
    with torch.no_grad():
        drive = control_loop(sim, network, network.initial_state(), loop)
        drive.run(sim, STEPS)
    poses = (sim.mass_poses(), sim.mass_velocities(), sim.readings())
    return digest(*poses, *drive.state().weights)


@pytest.mark.parametrize(
    ("engine", "precision"),
    [
        ("plain", "f32"),
        ("self-collision", "f32"),
        *(
            pytest.param(engine, precision, marks=pytest.mark.slow)
            for engine, precision in (
                ("plain", "f64"),
                ("continuous", "f32"),
                ("both", "f32"),
                ("self-collision", "f64"),
                ("continuous", "f64"),
                ("both", "f64"),
            )
        ),
    ],
)
def test_trajectories_are_as_recorded(engine: str, precision: str) -> None:
    dtype = {"f32": torch.float32, "f64": torch.float64}[precision]
    found, expected = {}, {}
    for shape in SHAPES:
        for loop in ("open", "fused", "torch"):
            if loop == "torch" and not SAME_TORCH:
                continue
            name = f"{shape} {engine} {loop} {precision}"
            sim = worlds(shape, engine, dtype)
            found[name] = open_loop(sim) if loop == "open" else closed_loop(sim, loop)
            expected[name] = RECORDED["hashes"][name]
    assert found == expected
