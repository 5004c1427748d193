"""Learning taken apart, in the course of evolution: the same champions on the same terrains while
they learn, and with weights frozen at several times of an episode.

Speeds are paired by terrain, noise and damage, so that nothing but plasticity differs. With weights
frozen at 0 s a robot has what it starts with; what evolution makes innate shows there.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import torch
from torch import Tensor

from experiments.analysis.freezing import act, learn, training_and_test
from experiments.analysis.unseen import speeds_on
from experiments.config import EvolveConfig
from experiments.io.csvfile import write_csv
from experiments.rollout.scenarios import Scenarios
from experiments.runs.archive import Archive
from experiments.runs.champions import Champions
from experiments.runs.names import PAIRED

__all__ = ["FROZEN_AT", "compare", "write"]

FROZEN_AT = (0.0, 1.0, 5.0, 20.0, 60.0)
"""When weights are frozen [s]; those beyond the end of an episode are left out."""

_TERRAINS = 30  # of the champions
_TERRAINS_OF_ARCHIVE = 10  # of each generation that was kept
_COLUMNS = ("generation", "run", "terrain", "frozen_at", "speed")


def write(folder: Path, seed: int = 0) -> Path:
    """Compare the champions of a run, and those of the generations that it kept.

    The file paired.csv has columns generation, run, terrain, frozen_at [s], which is nan while
    still plastic (and for static networks), and speed [m/s].

    Args:
        folder: The folder of a finished run.
        seed: decides noise, damage and the initial weights.

    Returns:
        The file.

    Raises:
        ValueError: the run cannot be read.
    """
    champions, archive = Champions.load(folder), Archive.load(folder)
    config = champions.config
    rows = list(_rows(config, config.generations, champions.genomes, _TERRAINS, seed))
    for generation, genomes in [] if archive is None else _kept(archive):
        rows += _rows(config, generation, genomes, _TERRAINS_OF_ARCHIVE, seed)
    return write_csv(folder / PAIRED, _COLUMNS, sorted(rows, key=lambda row: row[0]))


def compare(config: EvolveConfig, genomes: Tensor, test: Scenarios, training: Scenarios) -> Tensor:
    """Speeds of individuals while they learn, and with frozen weights.

    Args:
        config: The options of their evolution.
        genomes: shape (K, G).
        test: S scenarios, the same for all.
        training: the one scenario in which the weights to be frozen are learned.

    Returns:
        Speeds [m/s], shape (modes, K, S), float64: plastic, then frozen at each of `FROZEN_AT`
        within the duration (a static network has the first alone); NaN where an episode failed.
    """
    plastic = speeds_on(config, genomes, test)[None]
    if config.controller != "hebbian":
        return plastic
    snapshots = learn(config, genomes, _times(config), training)
    return torch.cat([plastic, act(config, snapshots, test, genomes).cpu()])


def _times(config: EvolveConfig) -> list[float]:
    return [time for time in FROZEN_AT if time <= config.duration]


def _kept(archive: Archive) -> Iterator[tuple[int, Tensor]]:
    """Generations before the last, whose best are the champions."""
    for generation, genomes in zip(archive.generations.tolist(), archive.genomes, strict=True):
        if generation < archive.config.generations:
            yield generation, genomes


def _rows(
    config: EvolveConfig, generation: int, genomes: Tensor, n_terrains: int, seed: int
) -> Iterator[tuple[int, int, str, float, float]]:
    training, test = training_and_test(config, n_terrains, seed)
    speeds = compare(config, genomes, test, training)
    for frozen_at, of_mode in zip([math.nan, *_times(config)], speeds.tolist(), strict=False):
        for run, of_run in enumerate(of_mode):
            for terrain, speed in zip(test.names, of_run, strict=True):
                yield generation, run, terrain, frozen_at, speed
