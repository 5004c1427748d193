"""What episodes meet: terrain, sensor noise, damage and initial weights, all decided by seeds."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from experiments.config import EvolveConfig
from experiments.rollout import seeds
from physics import Damage, Terrain

__all__ = ["Scenarios", "damage"]


@dataclass(frozen=True)
class Scenarios:
    """What S episodes meet, one robot each.

    Attributes:
        terrains: The terrain of each episode, S of them.
        world_seeds: Seeds of sensor noise and damage, S of them.
        init_seeds: Seeds of the initial weights, S of them.
    """

    terrains: list[Terrain]
    world_seeds: list[int]
    init_seeds: list[int]

    @classmethod
    def training(
        cls, terrain: str | Terrain, individuals: Iterable[tuple[int, int, int]]
    ) -> Scenarios:
        """What individuals meet when an evolution evaluates them.

        Args:
            terrain: A kind of terrain ("hilly-3-30", one of its own for every individual), a full
                name ("hilly-3-30-7", the same for all) or a Terrain.
            individuals: The seed of the run, the generation from 1 and the index of each.
        """
        each = list(individuals)
        return cls(
            _terrains(terrain, [seeds.terrain_seed(*one) for one in each]),
            [seeds.derive(run, "world", *rest) for run, *rest in each],
            [seeds.derive(run, "init", *rest) for run, *rest in each],
        )

    @classmethod
    def unseen(
        cls, terrain: str | Terrain, terrain_seeds: Sequence[int], seed: int = 0
    ) -> Scenarios:
        """Test terrains of one kind, which no evolution meets.

        Args:
            terrain: As for `training`; a full name or a Terrain is the same every time, with
                other noise and damage.
            terrain_seeds: Seeds of S terrains, such as `seeds.unseen_terrain_seeds(S)`.
            seed: Decides noise, damage and the initial weights.
        """
        return cls(
            _terrains(terrain, terrain_seeds),
            [seeds.derive(seed, "unseen", each) for each in terrain_seeds],
            [seeds.derive(seed, "unseen-init", each) for each in terrain_seeds],
        )

    @property
    def names(self) -> list[str]:
        """Names of the terrains."""
        return [terrain.name for terrain in self.terrains]

    def __add__(self, other: Scenarios) -> Scenarios:
        return Scenarios(
            self.terrains + other.terrains,
            self.world_seeds + other.world_seeds,
            self.init_seeds + other.init_seeds,
        )

    def __mul__(self, times: int) -> Scenarios:
        return Scenarios(self.terrains * times, self.world_seeds * times, self.init_seeds * times)

    def __len__(self) -> int:
        return len(self.terrains)


def damage(config: EvolveConfig, n_voxels: int) -> Damage | None:
    """The damage of an episode: None, or as in the paper (Sec. IV-B) one half of the voxels.

    Args:
        config: The options; by default voxels break at half of its duration, by chance.
        n_voxels: Of the robot.

    Raises:
        ValueError: the options name a voxel that it does not have.
    """
    if config.damage == "none":
        return None
    mask = None
    if numbers := config.voxels_that_break():
        if max(numbers) >= n_voxels:
            raise ValueError(
                f"damage_voxels: expected numbers from 0 to {n_voxels - 1}, got "
                f"{config.damage_voxels!r}"
            )
        mask = [voxel in numbers for voxel in range(n_voxels)]
    return Damage(
        config.damage_probability,
        config.duration / 2 if config.damage_time is None else config.damage_time,
        config.damage_mode,
        math.inf if config.damage_until is None else config.damage_until,
        mask,
    )


def _terrains(spec: str | Terrain, terrain_seeds: Sequence[int]) -> list[Terrain]:
    """A terrain for each seed; those of an open name are drawn together, which is faster."""
    if isinstance(spec, str) and Terrain.is_open(spec):
        return Terrain.from_open_name(spec, terrain_seeds)
    one = spec if isinstance(spec, Terrain) else Terrain.from_name(spec)
    return [one] * len(terrain_seeds)
