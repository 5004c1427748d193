"""A world does the same alone and in any company, to the last bit."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import torch

from experiments.validate.case import Case, Check, Outcome, Setting, Tolerance
from experiments.validate.motion import DTYPES
from physics import Terrain

__all__ = ["cases"]

_SHAPE, _HILLS = "biped-4x3", 20
_SECONDS = 5
_COMPANIES = ((7, 3, 1), (400, 211, 1), (400, 211, 2))  # worlds, our place among them, threads
_EQUAL = Tolerance("at most", 0.0)


def cases() -> list[Case]:
    """One per number type."""
    return [Case(f"batches {label}", partial(_replay, label)) for label in DTYPES]


def _replay(label: str, setting: Setting) -> Outcome:
    alone = _trajectory(label, setting, worlds=1, place=0, threads=1)
    rows = []
    for worlds, place, threads in _COMPANIES:
        ours = _trajectory(label, setting, worlds, place, threads)
        measure = f"values unlike alone: {worlds} worlds, {threads} thread{'s' * (threads > 1)}"
        differing = int(np.count_nonzero(ours != alone))
        rows.append(Check(f"batches {label}", measure, 0.0, differing, _EQUAL))
    return Outcome(tuple(rows))


def _trajectory(label: str, setting: Setting, worlds: int, place: int, threads: int) -> np.ndarray:
    """Poses and velocities of one world at every second; the others do something else."""
    terrains = [
        Terrain.from_name(f"hilly-3-30-{(world - place) % _HILLS}") for world in range(worlds)
    ]
    sim = setting.simulator(_SHAPE, terrains, worlds, dtype=DTYPES[label], threads=threads)
    generator = torch.Generator().manual_seed(setting.seed)
    phase = 2 * math.pi * torch.rand(sim.n_voxels, generator=generator, dtype=torch.float64)
    times = torch.arange(60 * _SECONDS, dtype=torch.float64)[:, None, None] / 60
    delays = 0.01 * (torch.arange(worlds, dtype=torch.float64) - place)[:, None]
    actuations = torch.sin(2 * math.pi * (times - delays) + phase).to(sim.dtype)
    history = []
    for second in actuations.split(60):
        sim.run(second)
        history += [sim.mass_poses()[place], sim.mass_velocities()[place]]
    return torch.stack(history).cpu().numpy()
