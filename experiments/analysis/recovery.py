"""What damage leaves of a gait: the same champions on the same terrains, with and without it.

The speed of a whole episode with damage (paper, Fig. 5) contains the time before it. Here the times
before and after are apart; and the episodes are in pairs, alike up to the damage.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import torch
from torch import Tensor

from experiments.config import EvolveConfig
from experiments.rollout import seeds
from experiments.rollout.episode import start_episode
from experiments.rollout.scenarios import Scenarios, damage
from experiments.runs.champions import Champions
from experiments.runs.names import MORE_EVALUATION_TERRAINS

__all__ = ["COLUMNS", "rows", "speeds_around"]

COLUMNS = ("run", "terrain", "speed_before", "speed_after", "speed_undamaged")
"""Of its table, in m/s: before the damage, after it, and in that time without any."""


def rows(champions: Champions) -> Iterator[tuple[int, str, float, float, float]]:
    """Assess champions around damage, whether they evolved with it or not; see `COLUMNS`."""
    config = champions.config
    test = Scenarios.unseen(config.terrain, seeds.unseen_terrain_seeds(MORE_EVALUATION_TERRAINS))
    for run, of_run in enumerate(speeds_around(config, champions.genomes, test).tolist()):
        for terrain, speeds in zip(test.names, of_run, strict=True):
            yield (run, terrain, *speeds)


def speeds_around(config: EvolveConfig, genomes: Tensor, test: Scenarios) -> Tensor:
    """Speeds of individuals before and after damage, and after that time without damage.

    Args:
        config: The options of their evolution; they tell when and how voxels break, by default at
            half of the episode, also where the evolution had no damage.
        genomes: shape (K, G).
        test: S scenarios, the same for all.

    Returns:
        Speeds [m/s], shape (K, S, 3), float64: before, after, undamaged; NaN where the episode had
        failed by then.

    Raises:
        ValueError: voxels break at one of the ends of the episode.
    """
    damaged, whole = (
        _speeds(replace(config, damage=kind), genomes, test) for kind in ("half", "none")
    )
    return torch.cat([damaged, whole[..., 1:]], -1)


def _speeds(config: EvolveConfig, genomes: Tensor, test: Scenarios) -> Tensor:
    """Speeds up to the time of the damage, whether there is any, and from then on."""
    episode = start_episode(config, genomes.repeat_interleave(len(test), 0), test * len(genomes))
    breaks = damage(replace(config, damage="half"), episode.sim.n_voxels)
    assert breaks is not None
    if not 1 < episode.sim.control_steps(breaks.time) < episode.n_steps:
        raise ValueError(
            f"damage_time: expected damage within the episode of {config.duration:g} s, got "
            f"{breaks.time:g} s, which leaves no time before or after it"
        )
    speeds = episode.speeds([breaks.time, config.duration])
    return speeds.cpu().reshape(len(genomes), len(test), 2)
