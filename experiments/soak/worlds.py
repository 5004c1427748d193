"""Random robots on random terrains, at rest and at work, with random damage."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch
from torch import Tensor

from experiments.soak.energy import energy_per_kg
from experiments.soak.memory import resident_memory
from physics import Damage, Morphology, Simulator, Terrain

__all__ = ["WorldCounts", "try_worlds"]

_WORLDS = 16  # of a trial, one full group
_PASSIVE_STEPS, _ACTIVE_STEPS = 600, 600
_LOOK = 6  # steps between two looks
_MOST_RISE = 1.0  # of a passive robot's energy over its least so far [J/kg]
_MOST_DEPTH = 1.5  # of a voxel's centre under the ground [m]
_SHAPES = (
    *("biped-4x3", "worm-7x1", "box-2x2", "tripod-5x3", "comb-7x2", "T-3x3", "ball-3", "box-1x1"),
    *("worm-3x1", "biped-6x4"),
)
_MODES = ("rest", "frozen", "random", "blind")
_FAMILIES = ("flat", "hilly-3-30", "hilly-1-10", "steppy-1-10", "steppy-3-10", "steppy-5-10")


@dataclass
class WorldCounts:
    """What was seen of the worlds.

    Attributes:
        trials: The number of simulators tried.
        worlds: Robots, all in all.
        steps: The number of robot-steps made.
        faults: How many worlds did what none should do, by what it was.
        largest_rise: The largest rise of a passive robot's energy over its least so far [J/kg].
        deepest: A voxel's centre under the ground [m].
        memory: Resident memory after the first trials and now [MB].
        examples: The first trials with a fault, to repeat them.
    """

    trials: int = 0
    worlds: int = 0
    steps: int = 0
    faults: Counter[str] = field(default_factory=Counter)
    largest_rise: float = 0.0
    deepest: float = 0.0
    memory: list[float] = field(default_factory=list)
    examples: list[str] = field(default_factory=list)


def try_worlds(seed: int, trial: int, counts: WorldCounts) -> None:
    """One trial: a batch of random robots that do nothing, and then move at random.

    Args:
        seed: The seed of all trials.
        trial: Number of this one; with the seed it decides everything.
        counts: The counts so far, to which this trial is added.
    """
    draws = np.random.default_rng((seed, trial))
    shape = _shape(draws)
    names, terrains = _terrains(draws)
    damage = None
    if draws.random() < 0.5:
        time = float(draws.uniform(0, 10))
        until = math.inf if draws.random() < 0.5 else time + float(draws.uniform(0.1, 5))
        damage = Damage(float(draws.random()), time, str(draws.choice(_MODES)), until)
    faults: Counter[str] = Counter()
    settings: dict[str, Any] = {
        "sensors": str(draws.choice(["low", "medium", "high"])),
        "seed": int(draws.integers(2**31)),
        "noise": float(draws.choice([0.0, 0.05])),
        "threads": 1,
    }
    rise = _rest(Simulator(shape, terrains, _WORLDS, **settings), terrains, faults)
    sim = Simulator(shape, terrains, _WORLDS, damage=damage, **settings)
    depth = _move(sim, terrains, draws, faults)
    counts.trials += 1
    counts.worlds += 2 * _WORLDS
    counts.steps += _WORLDS * (_PASSIVE_STEPS + _ACTIVE_STEPS)
    counts.faults.update(faults)
    counts.largest_rise = max(counts.largest_rise, rise)
    counts.deepest = max(counts.deepest, depth)
    if any(faults.values()) and len(counts.examples) < 20:
        words = f"seed {seed}, trial {trial}: {dict(faults)} {shape.cells} {names} {damage}"
        counts.examples.append(words)
    if counts.trials in (5, 50) or counts.trials % 100 == 0:
        counts.memory.append(resident_memory())


def _shape(draws: np.random.Generator) -> Morphology:
    """A named body, or a connected random one."""
    if draws.random() < 0.5:
        return Morphology.from_name(str(draws.choice(_SHAPES)))
    height, width = int(draws.integers(1, 4)), int(draws.integers(1, 6))
    grid = np.zeros((height, width), dtype=int)
    place = (int(draws.integers(height)), int(draws.integers(width)))
    for _ in range(int(draws.integers(1, 3 * height * width))):  # a walk, which is connected
        grid[place] = 1
        step = [(0, 1), (1, 0), (0, -1), (-1, 0)][int(draws.integers(4))]
        row = min(max(place[0] + step[0], 0), height - 1)
        place = (row, min(max(place[1] + step[1], 0), width - 1))
    return Morphology.of(grid)


def _terrains(draws: np.random.Generator) -> tuple[list[str], list[Terrain]]:
    """A terrain for each world, of one family or of one's own profile."""
    kind = int(draws.integers(len(_FAMILIES) + 3))
    if kind < len(_FAMILIES):
        family = _FAMILIES[kind]
        seeds = draws.integers(2**31, size=_WORLDS)
        names = [family if family == "flat" else f"{family}-{seed}" for seed in seeds]
    elif kind < len(_FAMILIES) + 2:
        family = "uphill" if kind == len(_FAMILIES) else "downhill"
        names = [f"{family}-{angle}" for angle in draws.integers(1, 35, size=_WORLDS)]
    else:
        xs = np.concatenate([[0.0, 10.0], 10 + np.cumsum(draws.uniform(0.05, 12, 60))])
        ys = np.concatenate([[100.0, 5.0], 5 + np.cumsum(draws.normal(0, 1.5, 60))])
        return [f"{xs.tolist()} {ys.tolist()}"], [Terrain.from_profile(xs, ys)] * _WORLDS
    return names, [Terrain.from_name(name) for name in names]


def _rest(sim: Simulator, terrains: list[Terrain], faults: Counter[str]) -> float:
    """Lets passive robots fall and come to rest; the greatest rise of their energy [J/kg]."""
    zeros = torch.zeros(_LOOK, _WORLDS, sim.n_voxels, dtype=torch.float32, device="cpu")
    least = energy_per_kg(sim)
    rise = torch.zeros_like(least)
    present = torch.ones(_WORLDS, dtype=torch.bool, device="cpu")
    for _ in range(_PASSIVE_STEPS // _LOOK):
        sim.run(zeros)
        energy = energy_per_kg(sim)
        present &= _present(sim, terrains)
        rise = torch.where(present, torch.maximum(rise, energy - least), rise)
        least = torch.minimum(least, energy)
    faults["passive robot failed"] += int(sim.failed().sum())
    faults[f"energy rose by more than {_MOST_RISE} J/kg"] += int((rise > _MOST_RISE).sum())
    return float(rise.max())


def _move(
    sim: Simulator, terrains: list[Terrain], draws: np.random.Generator, faults: Counter[str]
) -> float:
    """Lets robots move; how deep the deepest voxel was under the ground [m]."""
    generator = torch.Generator("cpu").manual_seed(int(draws.integers(2**31)))
    shape = (_WORLDS, sim.n_voxels)
    phases = 2 * math.pi * torch.rand(shape, generator=generator, device="cpu")
    speeds = 2 * math.pi * torch.rand(shape, generator=generator, device="cpu") / 20
    deepest = torch.zeros(_WORLDS, dtype=torch.float64, device="cpu")
    odd = torch.zeros(_WORLDS, dtype=torch.bool, device="cpu")
    present = ~odd
    for first in range(0, _ACTIVE_STEPS, _LOOK):
        steps = torch.arange(first, first + _LOOK, device="cpu")[:, None, None]
        readings = sim.run((speeds * steps + phases).sin())
        centers = sim.voxel_centers().double()
        odd |= ~centers.isfinite().flatten(1).all(1)
        if readings is not None:
            odd |= ~readings.isfinite().all(1)
        present &= _present(sim, terrains)
        for world in present.nonzero().flatten().tolist():
            x, y = centers[world].unbind(-1)
            depth = torch.from_numpy(terrains[world].height(x.numpy())) - y
            deepest[world] = max(float(deepest[world]), float(depth.max()))
    faults["failed"] += int(sim.failed().sum())
    faults["not finite"] += int(odd.sum())
    faults["below the ground"] += int((deepest > _MOST_DEPTH).sum())
    return float(deepest.max())


def _present(sim: Simulator, terrains: list[Terrain]) -> Tensor:
    """Which worlds have not failed, with the whole robot between the ends of its terrain."""
    x = sim.voxel_centers()[..., 0].double()
    ends = torch.tensor([(t.xs[0], t.xs[-1]) for t in terrains], dtype=x.dtype, device="cpu")
    inside = (x > ends[:, :1] + 3) & (x < ends[:, 1:] - 3)
    return ~sim.failed() & inside.all(1)
