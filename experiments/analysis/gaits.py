"""How champions move, plastic or static: frequency and vibration of their gaits."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from experiments.analysis.measures import gait_measures
from experiments.config import EvolveConfig
from experiments.io.csvfile import write_csv
from experiments.rollout import seeds
from experiments.rollout.episode import simulator, start_episode
from experiments.rollout.scenarios import Scenarios
from experiments.runs.champions import Champions
from experiments.runs.names import GAITS
from physics import DT, Simulator

__all__ = ["areas_and_speeds", "write"]

_TERRAINS = 4
_WATCHED = 30.0  # [s], at the end of an episode, or half of a shorter one
_STILL = 1e-3  # standard deviation of areas: what moves less is at rest, but for rounding
_MEASURES = ("gait_period", "gait_frequency", "gait_regularity", "vibration")


def write(folder: Path, seed: int = 0) -> Path:
    """Watch the champions of a run on terrains that evolution never met.

    The file gaits.csv has columns run, terrain, speed [m/s] and those of `gait_measures`, NaN for
    robots that failed or stand still.

    Args:
        folder: The folder of a finished run.
        seed: decides noise, damage and the initial weights.

    Returns:
        The file.

    Raises:
        ValueError: the run cannot be read.
    """
    champions = Champions.load(folder)
    columns = ("run", "terrain", "speed", *_MEASURES)
    return write_csv(folder / GAITS, columns, _rows(champions, seed))


def _rows(champions: Champions, seed: int) -> Iterator[tuple[Any, ...]]:
    config = champions.config
    test = Scenarios.unseen(config.terrain, seeds.unseen_terrain_seeds(_TERRAINS), seed)
    genomes = champions.genomes.repeat_interleave(len(test), 0)
    areas, speeds, step = areas_and_speeds(config, genomes, test * len(champions.genomes))
    for k, speed in enumerate(speeds.tolist()):
        run, terrain = divmod(k, len(test))
        moves = math.isfinite(speed) and areas[:, k].std(axis=0).max() > _STILL
        own = gait_measures(areas[:, k], step) if moves else dict.fromkeys(_MEASURES)
        found = (math.nan if own[name] is None else own[name] for name in _MEASURES)
        yield run, terrain, speed, *found


@torch.no_grad()
def areas_and_speeds(
    config: EvolveConfig, genomes: Tensor, scenarios: Scenarios
) -> tuple[np.ndarray, Tensor, float]:
    """Bodies in the last 30 s of episodes (the last half of shorter ones).

    Where control steps are longer than engine steps, the robots are moved once more by the same
    actuation and seen at every engine step: a body that changes with every control step could not
    be told from one that stands still. (Not with a low-pass, whose output changes in between.)

    Args:
        config: The options of the evolution.
        genomes: One per individual, shape (N, G).
        scenarios: What each individual meets, N of them.

    Returns:
        The areas of the voxels over those at rest, shape (T, N, V); the speeds of the whole
        episodes [m/s], (N,), NaN where one failed; the time between two rows of areas [s].
    """
    episode = start_episode(config, genomes, scenarios)
    interval = config.control_interval
    if interval > 1 and config.actuation_cutoff is None:
        actuations = []
        for _ in range(episode.n_steps):
            actuations.append(episode.sim.actuation())
            episode.run(1)
        plain = replace(config, control_interval=1, control_delay=0)
        sim = simulator(plain, scenarios)
        areas = _moved_by(sim, torch.stack(actuations).repeat_interleave(interval, 0))
        return areas, episode.finish().speed, DT
    first = episode.n_steps - _watched(config.duration, interval)
    episode.run(first)
    rows = []
    while episode.steps_done < episode.n_steps:
        episode.run(1)
        rows.append(episode.sim.area_ratios())
    return torch.stack(rows).cpu().numpy(), episode.finish().speed, DT * interval


def _moved_by(sim: Simulator, actuations: Tensor) -> np.ndarray:
    """The areas while worlds are moved by actuations, (engine steps, N, V), from the start on."""
    first = len(actuations) - _watched(DT * len(actuations), 1)
    sim.run(actuations[:first])
    rows = []
    for actuation in actuations[first:]:
        sim.step(actuation)
        rows.append(sim.area_ratios())
    return torch.stack(rows).cpu().numpy()


def _watched(duration: float, interval: int) -> int:
    """Control steps that are watched."""
    return max(1, round(min(_WATCHED, duration / 2) / (DT * interval)))
