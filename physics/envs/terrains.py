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
        if callable(ground):
            self._make = ground
        elif isinstance(ground, str) and _is_open(ground):
            self._make = lambda seed: Terrain.from_name(f"{ground}-{seed}")
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
        return self._make is not None

    def of_episodes(self, seeds: np.ndarray, episodes: np.ndarray) -> Sequence[Terrain] | None:
        """The terrains of some worlds.

        Args:
            seeds: The seeds of the worlds, (k,) uint64.
            episodes: the number of each one's episode, (k,) uint64.

        Returns:
            k terrains, or None if there is no ground.
        """
        if self._make is None:
            return None if self._fixed is None else [self._fixed] * len(seeds)
        draws = mixed(seeds + np.uint64(_STREAM), episodes) >> 1
        return [self._make(int(draw)) for draw in draws]


def _is_open(name: str) -> bool:
    """Whether a name becomes one of a terrain by a seed."""
    try:
        Terrain.from_name(name)
    except ValueError:
        try:
            Terrain.from_name(f"{name}-0")
        except ValueError:
            return False
        return True
    return False
