"""A terrain for every episode."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from physics.envs.tasks import Ground
from physics.scene.terrain import Terrain
from physics.worlds.seeds import mixed

__all__ = ["Terrains"]

_STREAM = 0x7E22A1  # keeps these seeds apart from those of noise and damage


class Terrains:
    """Where the terrains of episodes come from.

    Attributes:
        varied: whether every episode has a terrain of its own.
    """

    def __init__(self, ground: Ground | None) -> None:
        """Finds out whether a name leaves its seed open.

        Args:
            ground: see `tasks.Ground`; None for no ground.

        Raises:
            ValueError: it is none of these, or names no terrain.
        """
        self._fixed: Terrain | None = None
        self._make: Callable[[int], Terrain] | None = None
        self._name: str | None = None
        self._ready: dict[tuple[int, int], Terrain] = {}  # by seed and episode
        if callable(ground):
            self._make = ground
        elif isinstance(ground, str) and Terrain.is_open(ground):
            Terrain.from_name(ground, 0)  # refuses wrong numbers at once
            self._name = ground
        elif isinstance(ground, str):
            self._fixed = Terrain.from_name(ground)
        elif ground is None or isinstance(ground, Terrain):
            self._fixed = ground
        else:
            raise ValueError(
                "terrain: expected a Terrain, a name, a function from a seed to a Terrain, or "
                f"None, got {ground!r}"
            )

    @property
    def varied(self) -> bool:
        """Whether every episode has a terrain of its own."""
        return self._make is not None or self._name is not None

    @property
    def foreseen(self) -> bool:
        """Whether terrains can be made before they are needed: not by a function of others."""
        return self._make is None

    def prepare(self, seeds: np.ndarray, episodes: np.ndarray) -> list[Terrain] | None:
        """`of_episodes`, ahead of need: together that is cheaper. None unless a name is open."""
        if self._name is None:
            return None
        if len(self._ready) > 4 * len(seeds) + 64:  # of episodes that were never begun
            self._ready.clear()
        keys = list(zip(seeds.tolist(), episodes.tolist(), strict=True))
        new = [key for key in dict.fromkeys(keys) if key not in self._ready]
        if new:
            draws = _draws(*np.array(new, dtype=np.uint64).T)
            self._ready.update(zip(new, Terrain.from_open_name(self._name, draws), strict=True))
        return [self._ready[key] for key in keys]

    def of_episodes(self, seeds: np.ndarray, episodes: np.ndarray) -> Sequence[Terrain] | None:
        """The terrains of some worlds.

        Args:
            seeds: The seeds of the worlds, (k,) uint64.
            episodes: the number of each one's episode, (k,) uint64.

        Returns:
            k terrains, or None if there is no ground.
        """
        if not self.varied:
            return None if self._fixed is None else [self._fixed] * len(seeds)
        if self._make is not None:
            return [self._make(draw) for draw in _draws(seeds, episodes)]
        terrains = self.prepare(seeds, episodes)
        for key in zip(seeds.tolist(), episodes.tolist(), strict=True):
            self._ready.pop(key, None)
        return terrains


def _draws(seeds: np.ndarray, episodes: np.ndarray) -> list[int]:
    """The seeds of the terrains of some worlds' episodes."""
    return (mixed(seeds + np.uint64(_STREAM), episodes) >> 1).tolist()
