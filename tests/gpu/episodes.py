"""What the GPU's program and the CPU's are compared on; as a command, on the stand-in for a GPU.

``python -m tests.gpu.episodes PRECISION FOLDER FILE`` saves what it gives in the file. A process is
used for all of one precision, so that its kernels are compiled once; the CPU has lanes=8 throughout
for the same reason.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from experiments.config import EvolveConfig
from experiments.rollout.evaluate import Evaluator
from physics import Engine, Simulator, Terrain
from physics.envs import VoxelVectorEnv
from tests.gpu import pretend
from tests.physics.worlds import gaits

MANY = 48_000  # worlds; its square overflows 32 bits

_WHOLE_ENGINE = Engine(self_collision=True, continuous=True)


def single(device: str) -> dict[str, Tensor]:
    """In float32: gaits, resets and learning of worms, and very many boxes."""
    worms = _gaits(device, "worm-7x1", 20, torch.float32)
    return {**worms, **_resets(device), **_brood(device), **_many(device)}


def double(device: str) -> dict[str, Tensor]:
    """In float64, with all features of the engine: gaits of worms and bipeds."""
    return {
        **_gaits(device, "worm-7x1", 30, torch.float64, _WHOLE_ENGINE),
        **_gaits(device, "biped-4x3", 20, torch.float64, _WHOLE_ENGINE),
    }


def _gaits(
    device: str, shape: str, steps: int, dtype: torch.dtype, engine: Engine | None = None
) -> dict[str, Tensor]:
    """40 gaits on hills: centres of mass after each step, (steps, 40, 2) [m]; last readings."""
    terrains = [Terrain.from_name(f"hilly-3-30-{seed % 20}") for seed in range(40)]
    options: dict[str, Any] = {"sensors": "high", "dtype": dtype, "engine": engine}
    sim = _simulator(device, shape, terrains, 40, **options)
    way = []
    for actuation in gaits(steps, 40, sim.n_voxels):
        readings = sim.step(actuation)
        way.append(sim.center_of_mass())
    assert readings is not None
    assert readings.device.type == way[0].device.type == device
    return {shape: torch.stack(way).cpu(), f"readings of {shape}": readings.cpu()}


def _resets(device: str) -> dict[str, Tensor]:
    """Observations (13, 6, R) and centres (12, 6, 2) of environments of which one after the other
    is reset, on another terrain."""
    lanes = 1 if device == "cuda" else 8
    settings: dict[str, Any] = {"sensors": "high", "device": device, "lanes": lanes}
    env = VoxelVectorEnv("worm-7x1", "hilly-3-30", 6, episode=0.1, **settings)
    observations, centers = [env.reset(seed=0)[0]], []
    env.spread_phases()
    for actuation in gaits(12, 6, 7).float():
        *outputs, infos = env.step(actuation)
        observations.append(outputs[0])
        centers.append(infos["center"])
        assert all(each.device.type == device for each in (*outputs, centers[-1]))
    return {"observations": torch.stack(observations).cpu(), "centers": torch.stack(centers).cpu()}


def _brood(device: str) -> dict[str, Tensor]:
    """Speeds (8,) and first weights of Hebbian worms after 1 s in the kernel: no squares of a worm
    share a corner, where rounding decides whether they touch."""
    config = EvolveConfig(
        shape="worm-7x1", sensors="high", duration=1.0, device=device, runs=1, population=8
    )
    evaluator = Evaluator(config)
    genomes = torch.rand(1, 8, evaluator.n_genes, generator=torch.Generator().manual_seed(1))
    life = evaluator((2 * genomes - 1).to(device), 1)
    weights = life.state.weights[0]
    assert weights.device.type == life.speed.device.type == device
    return {"speeds": life.speed.cpu(), "weights": weights.cpu()}


def _many(device: str) -> dict[str, Tensor]:
    """Steps made, (MANY,), and squares, (MANY, 1, 4, 3), after one step of boxes in space."""
    sim = _simulator(device, "box-1x1", None, MANY)
    sim.step(torch.linspace(-1, 1, MANY)[:, None])
    return {"steps": sim._state.steps().cpu(), "squares": sim.mass_poses().cpu()}


def _simulator(device: str, *args: Any, **kwargs: Any) -> Simulator:
    return Simulator(*args, device=device, lanes=1 if device == "cuda" else 8, **kwargs)


def _calls(driver: pretend.Driver) -> dict[str, list[str]]:
    """What runs ask of the driver and of PyTorch, after the first, by where actuations lie."""
    sim = Simulator("worm-7x1", Terrain.from_name("flat"), 40, sensors="high", device="cuda")
    on_host = gaits(3, 40, 7).float()
    on_gpu = on_host.to("cuda")
    sim.run(on_gpu)
    return {
        "gpu": driver.during(lambda: sim.run(on_gpu)),
        "host": driver.during(lambda: sim.run(on_host)),
        "host, unmoved": driver.during(lambda: sim._play(on_host, sim._readings(), 0, 3)),
    }


if __name__ == "__main__":
    precision, folder, file = sys.argv[1:]
    driver = pretend.start(Path(folder))
    found: dict[str, Any] = {"single": single, "double": double}[precision]("cuda")
    if precision == "single":
        found["calls"] = _calls(driver)
    found["launches"] = driver.log().count("cuLaunchKernel")
    torch.save(found, file)
