"""How high robots start on their terrains, worked out once for each terrain."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from physics.engine.memory import layout as lay
from physics.engine.memory import state as st
from physics.scene.bodies import Bodies
from physics.scene.terrain import Terrain
from physics.worlds.profiles import segments_within

__all__ = ["START_ITEMS", "Starts"]

START_ITEMS = lay.SIN + 1  # of a square that has just been placed: x, y, angle, cosine, sine


class Starts:
    """The poses in which robots start, and how much of a terrain may be under them."""

    def __init__(self, bodies: Bodies, extent: float, n_worlds: int, ground: bool) -> None:
        """Places every robot on level ground.

        Args:
            bodies: The robots.
            extent: width of ground that a robot may need at once, whatever its posture [m].
            n_worlds: N; so many terrains are remembered at least.
            ground: whether there is any.
        """
        self._shapes = [body.morphology for body in bodies.unlike]
        self._extent = extent
        self._most = n_worlds + 64
        self._lifts: dict[tuple[int, Terrain], float] = {}
        self._segments: dict[Terrain, int] = {}
        self._level = [self._placed(st.level_poses(shape, ground)) for shape in self._shapes]

    def segments(self, terrains: Sequence[Terrain]) -> int:
        """The most segments that may be within the extent at once on any of some terrains."""
        new = [terrain for terrain in terrains if terrain not in self._segments]
        if new and len(self._segments) > self._most:  # most are of terrains that are gone
            self._segments.clear()
            new = list(terrains)
        for terrain in new:
            self._segments[terrain] = segments_within(terrain.xs, self._extent)
        return max(self._segments[terrain] for terrain in terrains)

    def lifts(self, robot: int, terrains: Sequence[Terrain]) -> np.ndarray:
        """How much higher than `level` a robot starts on k terrains [m], (k,).

        Args:
            robot: its number among those that differ.
            terrains: k of them.
        """
        new = [terrain for terrain in terrains if (robot, terrain) not in self._lifts]
        if new and len(self._lifts) > self._most:
            self._lifts.clear()
            new = list(terrains)
        for terrain in new:
            self._lifts[robot, terrain] = st.lift(self._shapes[robot], terrain)
        return np.array([self._lifts[robot, terrain] for terrain in terrains])

    def level(self, robot: int) -> np.ndarray:
        """Poses of a robot that is lifted by nothing, (V, 4, START_ITEMS), float64."""
        return self._level[robot]

    @staticmethod
    def _placed(poses: np.ndarray) -> np.ndarray:
        """Poses (V, 4, 3) with cosine and sine of their angles."""
        angles = poses[..., 2:]
        return np.concatenate([poses, np.cos(angles), np.sin(angles)], -1)
