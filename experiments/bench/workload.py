"""Robots at work: batches that have landed and walk, ready to be timed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from functools import partial
from typing import Literal, Protocol

import torch
from torch import Tensor

import hebbtorch
from experiments.bench.setting import Setting
from experiments.rollout import fused
from physics import DT, Simulator, Terrain

__all__ = ["GAITS", "ClosedLoop", "OpenLoop", "OwnModule", "Workload", "warm_up"]

GAITS = 40  # different robots; larger batches repeat them, so that the work per robot is the same
_TERRAINS = 20
_NOISE = 0.01


class Workload(Protocol):
    """A batch of robots.

    Attributes:
        sim: The simulator with their worlds.
    """

    sim: Simulator

    def stretch(self, steps: int) -> Callable[[], object]:
        """The call that lets them live for some steps more; making it ready is not its work."""


def warm_up(workloads: Iterable[Workload], setting: Setting) -> None:
    """Lets robots land and begin to walk."""
    for workload in workloads:
        workload.stretch(setting.warm_up)()


class OpenLoop:
    """Robots whose voxels beat in sine waves, each robot with its own frequency and phases."""

    def __init__(self, shape: str, n_worlds: int, seed: int) -> None:
        self.sim = _worlds(shape, n_worlds, seed, None, 0.0)
        draws = torch.Generator().manual_seed(seed)
        phases = 2 * math.pi * torch.rand(GAITS, self.sim.n_voxels, generator=draws)
        frequencies = 0.5 + 1.5 * torch.rand(GAITS, 1, generator=draws)  # [Hz]
        repeated = torch.arange(n_worlds) % GAITS
        self._phases, self._pulsations = phases[repeated], 2 * math.pi * frequencies[repeated]
        self._done = 0

    def stretch(self, steps: int) -> Callable[[], object]:
        """See `Workload`."""
        times = DT * torch.arange(self._done, self._done + steps)[:, None, None]
        self._done += steps
        return partial(self.sim.run, torch.sin(self._pulsations * times + self._phases))


class ClosedLoop:
    """Robots with the high apparatus and noise, driven by random networks in the kernel."""

    def __init__(
        self,
        shape: str,
        controller: Literal["hebbian", "mlp"],
        n_worlds: int,
        seed: int,
        device: str = "cpu",
    ) -> None:
        self.sim = _worlds(shape, n_worlds, seed, "high", _NOISE, device)
        inputs = self.sim.n_readings
        make = hebbtorch.HebbianMLP if controller == "hebbian" else hebbtorch.StaticMLP
        network = make([inputs, inputs, self.sim.n_voxels], population=(n_worlds,))
        draws = torch.Generator().manual_seed(seed)
        genomes = 2 * torch.rand(GAITS, network.n_genes, generator=draws) - 1
        network.set_genomes(genomes[torch.arange(n_worlds) % GAITS])
        self.loop = fused.pack(self.sim, network, network.initial_state())

    def stretch(self, steps: int) -> Callable[[], object]:
        """See `Workload`."""
        return partial(self.loop.run, self.sim, steps)


class OwnModule:
    """Robots with the high apparatus, driven step by step by a plain PyTorch module."""

    def __init__(self, shape: str, n_worlds: int, seed: int, device: str = "cpu") -> None:
        self.sim = _worlds(shape, n_worlds, seed, "high", 0.0, device)
        inputs, outputs = self.sim.n_readings, self.sim.n_voxels
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            self._module = torch.nn.Sequential(
                torch.nn.Linear(inputs, inputs),
                torch.nn.Tanh(),
                torch.nn.Linear(inputs, outputs),
                torch.nn.Tanh(),
            ).to(device)
        self._actuation = torch.zeros(n_worlds, outputs, device=device)

    def stretch(self, steps: int) -> Callable[[], object]:
        """See `Workload`."""
        return partial(self._live, steps)

    @torch.no_grad()
    def _live(self, steps: int) -> None:
        for _ in range(steps):
            readings: Tensor | None = self.sim.step(self._actuation)
            self._actuation = self._module(readings)


def _worlds(
    shape: str,
    n_worlds: int,
    seed: int,
    sensors: str | None,
    noise: float,
    device: str = "cpu",
) -> Simulator:
    terrains = [Terrain.from_name(f"hilly-3-30-{seed + k}") for k in range(_TERRAINS)]
    return Simulator(
        shape,
        [terrains[world % _TERRAINS] for world in range(n_worlds)],
        n_worlds,
        sensors=sensors,
        noise=noise,
        device=device,
        seed=seed,
        threads=1,
    )
