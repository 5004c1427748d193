"""Episodes ten times as long as those of evolution: does a gait last while weights keep growing?"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from torch import Tensor

from experiments.config import EvolveConfig
from experiments.rollout import seeds
from experiments.rollout.episode import start_episode
from experiments.rollout.scenarios import Scenarios
from experiments.runs.champions import Champions
from physics import Terrain

__all__ = ["COLUMNS", "long_terrain", "rows", "speeds_by_window"]

_TERRAINS = 3
_PIECES = 4  # of unseen terrains, one after the other: 7.9 km in all
_LENGTHS = 10  # of an episode of the evolution
_WINDOWS = 20  # in which the speed is measured
COLUMNS = ("run", "terrain", "window", "end", "speed")
"""Of its table: window from 0, its end [s] and the speed within it [m/s]."""


def rows(champions: Champions) -> Iterator[tuple[int, int, int, float, float]]:
    """Assess champions over a long time; see `COLUMNS`."""
    config = champions.config
    length = _LENGTHS * config.duration
    each = seeds.unseen_terrain_seeds(_TERRAINS)
    test = replace(
        Scenarios.unseen(config.terrain, each),
        terrains=[long_terrain(config.terrain, k * _PIECES, _PIECES) for k in each],
    )
    speeds = speeds_by_window(config, champions.genomes, test, length).tolist()
    for run, of_run in enumerate(speeds):
        for terrain, of_terrain in enumerate(of_run):
            for window, speed in enumerate(of_terrain):
                yield run, terrain, window, (window + 1) * length / _WINDOWS, speed


def speeds_by_window(
    config: EvolveConfig, genomes: Tensor, test: Scenarios, length: float
) -> Tensor:
    """Speeds of individuals in equal parts of a long episode.

    Args:
        config: The options of their evolution; voxels break, if any do, at half of the long
            episode.
        genomes: shape (K, G).
        test: S scenarios, the same for all.
        length: The length of the episode [s].

    Returns:
        Speeds [m/s], shape (K, S, 20), float64; NaN from the window in which an episode failed.
    """
    episode = start_episode(
        replace(config, duration=length),
        genomes.repeat_interleave(len(test), 0),
        test * len(genomes),
    )
    speeds = episode.speeds([(window + 1) * length / _WINDOWS for window in range(_WINDOWS)])
    return speeds.cpu().reshape(len(genomes), len(test), _WINDOWS)


def long_terrain(kind: str, first_seed: int, pieces: int) -> Terrain:
    """Terrains of one kind, one after the other between two walls.

    Args:
        kind: such as "hilly-3-30".
        first_seed: The seed of the first; the others have the next ones.
        pieces: The number of profiles that are joined.
    """
    parts = [Terrain.from_name(kind, first_seed + k) for k in range(pieces)]
    xs, ys = [parts[0].xs[:2]], [parts[0].ys[:2]]  # the wall, and the first point of the ground
    for part in parts:
        ground = slice(2, -1)  # from the second point on, without the walls
        xs.append(part.xs[ground] - part.xs[1] + xs[-1][-1])
        ys.append(part.ys[ground] - part.ys[1] + ys[-1][-1])
    wall = parts[-1].xs[-1] - parts[-1].xs[-2]
    xs.append(xs[-1][-1:] + wall)
    ys.append(np.maximum(ys[-1][-1:], 0.0) + parts[0].ys[0])
    name = f"{pieces} of {kind} from {first_seed} on"
    return Terrain.from_profile(np.concatenate(xs), np.concatenate(ys), name)
