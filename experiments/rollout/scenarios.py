"""What lives of a re-assessment meet: terrain, noise, damage and weights at birth, by seeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from experiments.config import fresh_terrain
from experiments.rollout import seeds
from physics import Terrain

__all__ = ["Grounds"]


@dataclass(frozen=True)
class Grounds:
    """What S lives meet.

    Attributes:
        names: of the terrains, S of them.
        worlds: seeds of noise and damage.
        births: seeds of the weights at birth.
    """

    names: list[str]
    worlds: list[int]
    births: list[int]

    @classmethod
    def unseen(cls, terrain: str, terrain_seeds: Sequence[int], seed: int) -> Grounds:
        """Terrains of one kind.

        Args:
            terrain: such as "hilly-3-30"; a full name or "flat" is the same every time, with
                other noise and damage.
            terrain_seeds: of S terrains, such as `seeds.unseen_terrain_seeds(S)`.
            seed: decides noise, damage and the weights at birth.
        """
        return cls(
            [fresh_terrain(terrain, each) for each in terrain_seeds],
            [seeds.derive(seed, "unseen", each) for each in terrain_seeds],
            [seeds.derive(seed, "unseen-init", each) for each in terrain_seeds],
        )

    def __add__(self, other: Grounds) -> Grounds:
        return Grounds(
            self.names + other.names, self.worlds + other.worlds, self.births + other.births
        )

    def __mul__(self, times: int) -> Grounds:
        return Grounds(self.names * times, self.worlds * times, self.births * times)

    def __len__(self) -> int:
        return len(self.names)

    def terrains(self) -> list[Terrain]:
        """The terrains themselves."""
        built = {name: Terrain.from_name(name) for name in set(self.names)}
        return [built[name] for name in self.names]
