"""Generalization proper: champions on terrains of their evolution, on unseen ones of the same kind,
and where something else is different: kind of ground, damage, gravity, friction.

Training and test terrains of one generator differ by nothing but a seed. What a champion loses
between the two tells how much selection favoured lucky episodes; what it keeps elsewhere tells how
far it generalizes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import reduce
from operator import add
from typing import Any

from torch import Tensor

from experiments.config import EvolveConfig
from experiments.rollout import seeds
from experiments.rollout.episode import start_episode
from experiments.rollout.scenarios import Scenarios
from experiments.runs.champions import Champions
from physics import Damage, Engine, Terrain

__all__ = ["COLUMNS", "SETTINGS", "TRAINING", "UNSEEN", "Setting", "rows", "speeds_in"]

TRAINING, UNSEEN = "training", "unseen"

_TERRAINS = 30
COLUMNS = ("setting", "run", "terrain", "speed")
"""Of its table; speed in m/s."""


@dataclass(frozen=True)
class Setting:
    """What champions meet.

    Attributes:
        name: The name of the setting.
        terrain: kind of ground; None for that of the evolution.
        physics: keywords of `Simulator` that are not as in the evolution.
        damage_mode: what the voxels that break at half of the episode do from then on (see
            `Damage`); None for the damage of the evolution.
    """

    name: str
    terrain: str | None = None
    physics: dict[str, Any] = field(default_factory=dict)
    damage_mode: str | None = None

    def keywords(self, duration: float) -> dict[str, Any]:
        """All keywords of `Simulator` that differ, in episodes of so many seconds."""
        if self.damage_mode is None:
            return self.physics
        return {**self.physics, "damage": Damage(time=duration / 2, mode=self.damage_mode)}


SETTINGS = (
    Setting(TRAINING),
    Setting(UNSEEN),
    *(
        Setting(kind, kind)
        for kind in ("flat", "hilly-1-10", "steppy-1-10", "uphill-10", "downhill-10")
    ),
    *(
        Setting(f"damage-{mode}", damage_mode=mode)
        for mode in ("rest", "frozen", "random", "blind")
    ),
    *(Setting(f"gravity-{g}", physics={"gravity": g}) for g in (4.9, 19.6)),
    *(Setting(f"friction-{mu}", physics={"engine": Engine(friction=mu)}) for mu in (0.35, 0.7)),
)
"""Of 30 episodes each; ordinary gravity is 9.8 m/s^2, ordinary friction 1.41."""


def rows(champions: Champions) -> Iterator[tuple[str, int, str, float]]:
    """Assess champions in all settings; see `COLUMNS`."""
    for setting in SETTINGS:
        yield from _rows(champions, setting)


def _rows(champions: Champions, setting: Setting) -> Iterator[tuple[str, int, str, float]]:
    config = champions.config
    n_runs = len(champions.genomes)
    kind = config.terrain if setting.terrain is None else setting.terrain
    unseen = Scenarios.unseen(kind, seeds.unseen_terrain_seeds(_TERRAINS))
    per_run = [unseen] * n_runs
    if setting.name == TRAINING:
        per_run = [
            replace(unseen, terrains=_training_terrains(config, run)) for run in range(n_runs)
        ]
    speeds = speeds_in(config, champions.genomes, per_run, setting.keywords(config.duration))
    for run, (scenarios, own) in enumerate(zip(per_run, speeds.tolist(), strict=True)):
        for terrain, speed in zip(scenarios.names, own, strict=True):
            yield setting.name, run, terrain, speed


def _training_terrains(config: EvolveConfig, run: int) -> list[Terrain]:
    """The last terrains that a run's evolution met, the latest first."""
    evaluations = (
        (generation, individual)
        for generation in range(config.generations, 0, -1)
        for individual in range(config.population)
    )
    terrains = [
        Terrain.from_name(config.terrain, seeds.terrain_seed(config.seed + run, *each))
        for each, _ in zip(evaluations, range(_TERRAINS), strict=False)
    ]
    return [terrains[k % len(terrains)] for k in range(_TERRAINS)]


def speeds_in(
    config: EvolveConfig, genomes: Tensor, scenarios: list[Scenarios], physics: dict[str, Any]
) -> Tensor:
    """Speeds of individuals, each in scenarios of its own.

    Args:
        config: The options of their evolution.
        genomes: shape (K, G).
        scenarios: S scenarios for each of the K.
        physics: keywords of `Simulator` that are not as in the evolution.

    Returns:
        Speeds [m/s], shape (K, S), float64, NaN where an episode failed.
    """
    each = len(scenarios[0])
    together = reduce(add, scenarios)
    episode = start_episode(config, genomes.repeat_interleave(each, 0), together, **physics)
    return episode.finish().speed.cpu().reshape(len(genomes), each)
