"""Episodes that are worked out before their worlds are reset."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from physics.engine.memory.layout import Layout
from physics.scene.terrain import Terrain

__all__ = ["Prepared"]


@dataclass(frozen=True, eq=False)
class Prepared:
    """How a world begins an episode, and what that follows from.

    Attributes:
        layout: where things lie in its state.
        seed: The seed of noise and damage.
        episode: How many the world has ended before it.
        terrain: The terrain; None without ground.
        values: its own items at the start, (I,).
        profile: points of the terrain, as many as kernels take, (K, 2).
    """

    layout: Layout
    seed: int
    episode: int
    terrain: Terrain | None
    values: np.ndarray
    profile: np.ndarray | None

    def fits(self, layout: Layout, seed: int, episode: int, terrain: Terrain | None) -> bool:
        """Whether it was worked out for just this."""
        same = self.terrain is terrain and self.layout == layout
        return same and (self.seed, self.episode) == (seed, episode)
