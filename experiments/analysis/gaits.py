"""How champions move, plastic or static: frequency and vibration of their gaits."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor

from experiments.analysis.measures import command_measures, gait_measures
from experiments.config import EvolveConfig
from experiments.rollout import seeds
from experiments.rollout.episode import simulator, start_episode
from experiments.rollout.scenarios import Scenarios
from experiments.runs.champions import Champions
from physics import DT, Simulator

__all__ = ["COLUMNS", "Motion", "rows", "watch"]

COLUMNS = (
    "run",
    "terrain",
    "speed",
    "gait_period",
    "gait_frequency",
    "gait_regularity",
    "vibration",
    "saturated",
    "alternating",
)
"""Of its table: speed in m/s, `gait_measures` and `command_measures`, which are NaN for robots that
failed or stand still."""

_TERRAINS = 4
_WATCHED = 30.0  # [s], at the end of an episode, or half of a shorter one
_STILL = 1e-3  # standard deviation of areas: what moves less is at rest, but for rounding


class Motion(NamedTuple):
    """The last 30 s of N episodes (the last half of shorter ones).

    Attributes:
        areas: of the voxels over those at rest, shape (T, N, V).
        step: The time between two rows of areas [s].
        actuation: in force, a row per control step, shape (C, N, V).
        speed: of the whole episodes [m/s], (N,), NaN where one failed.
    """

    areas: np.ndarray
    step: float
    actuation: np.ndarray
    speed: Tensor


def rows(champions: Champions) -> Iterator[tuple[Any, ...]]:
    """Watch champions on terrains that evolution never met; see `COLUMNS`."""
    config = champions.config
    test = Scenarios.unseen(config.terrain, seeds.unseen_terrain_seeds(_TERRAINS))
    genomes = champions.genomes.repeat_interleave(len(test), 0)
    motion = watch(config, genomes, test * len(champions.genomes))
    for k, speed in enumerate(motion.speed.tolist()):
        run, terrain = divmod(k, len(test))
        found: dict[str, Any] = {}
        if math.isfinite(speed) and motion.areas[:, k].std(axis=0).max() > _STILL:
            found = gait_measures(motion.areas[:, k], motion.step)
            found |= command_measures(motion.actuation[:, k])
        known = (found.get(name) for name in COLUMNS[3:])
        yield run, terrain, speed, *(math.nan if each is None else each for each in known)


@torch.no_grad()
def watch(config: EvolveConfig, genomes: Tensor, scenarios: Scenarios) -> Motion:
    """See how individuals move.

    Where control steps are longer than engine steps, the robots are moved once more by the same
    actuation and seen at every engine step: a body that changes with every control step could not
    be told from one that stands still. (Not with a low-pass, whose output changes in between.)

    Args:
        config: The options of the evolution.
        genomes: One per individual, shape (N, G).
        scenarios: What each individual meets, N of them.
    """
    episode = start_episode(config, genomes, scenarios)
    interval = config.control_interval
    last = _watched(config.duration, interval)
    again = interval > 1 and config.actuation_cutoff is None
    if not again:
        episode.run(episode.n_steps - last)
    actuations, areas = [], []
    while episode.steps_done < episode.n_steps:
        actuations.append(episode.sim.actuation())
        episode.run(1)
        if not again:
            areas.append(episode.sim.area_ratios())
    if again:
        plain = replace(config, control_interval=1, control_delay=0)
        every = torch.stack(actuations).repeat_interleave(interval, 0)
        areas = _moved_by(simulator(plain, scenarios), every)
    return Motion(
        torch.stack(areas).cpu().numpy(),
        DT if again else DT * interval,
        torch.stack(actuations[-last:]).cpu().numpy(),
        episode.finish().speed,
    )


def _moved_by(sim: Simulator, actuations: Tensor) -> list[Tensor]:
    """The areas while worlds are moved by actuations, (engine steps, N, V), from the start on."""
    first = len(actuations) - _watched(DT * len(actuations), 1)
    sim.run(actuations[:first])
    areas = []
    for actuation in actuations[first:]:
        sim.step(actuation)
        areas.append(sim.area_ratios())
    return areas


def _watched(duration: float, interval: int) -> int:
    """Control steps that are watched."""
    return max(1, round(min(_WATCHED, duration / 2) / (DT * interval)))
