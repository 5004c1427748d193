"""What the worlds of a batch start from: terrain, seed, episode, lifetime and damage of each."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from physics.engine.memory import layout as lay
from physics.engine.memory import state as st
from physics.engine.memory.layout import Layout
from physics.scene import clock
from physics.scene.conditions import Conditions
from physics.scene.damage import Damage
from physics.scene.morphology import Morphology
from physics.scene.terrain import Terrain
from physics.worlds.profiles import pack_terrains, padded, segments_within
from physics.worlds.seeds import mixed

__all__ = ["Batch"]

_POSE_ITEMS = lay.SIN + 1  # of a body: x, y, angle, cosine, sine
_FAR = 1e30  # where a world without ground ends [m]
_SPARE = 1.25  # room that grows does so by this much more


class Batch:
    """N worlds, as they are when an episode begins.

    Attributes:
        terrains: one per world, or None without ground.
        profiles: their points, (places, K, 2), as kernels take them.
        segments: of terrain that the window of a group must hold; 0 without ground.
        extent: width of that window [m].
        seeds: of noise and damage, (N,) int64 in [0, 2^32).
        episodes: that each world has ended since it got its seed, (N,) int64.
    """

    def __init__(
        self,
        morphology: Morphology,
        terrains: list[Terrain] | None,
        extent: float,
        seeds: np.ndarray,
        lifetimes: np.ndarray,
        damage: Damage | None,
        conditions: Conditions,
        places: int,
        like: Tensor,
    ) -> None:
        """Packs the terrains of N worlds.

        Args:
            morphology: of the robots.
            terrains: N of them, or None.
            extent: width of ground that a robot may need at once, whatever its posture [m].
            seeds: of every world, (N,) int64 in [0, 2^32).
            lifetimes: of every world, in engine steps, (N,).
            damage: of all worlds, if any.
            conditions: of all worlds.
            places: N and the places that fill up the last group.
            like: any tensor of the type and on the device of the state.

        Raises:
            ValueError: the damage has a mask for other voxels or worlds.
        """
        self.terrains = terrains
        self.seeds = seeds
        self.episodes = np.zeros(len(seeds), dtype=np.int64)
        self._morphology = morphology
        self.extent = extent
        self._lifetimes = np.minimum(lifetimes, clock.ENDLESS)
        self._damage = damage
        self._conditions = conditions if conditions.varied(morphology) else None
        self._like = like
        self._poses: dict[Terrain | None, Tensor] = {}
        self._first: tuple[Layout, Tensor] | None = None
        self.segments, profiles = pack_terrains(terrains, extent, places)
        self.profiles = torch.from_numpy(profiles).to(like)
        self._mask = None if damage is None else damage.broken_mask(len(seeds), morphology.n_voxels)

    # --- changes between episodes ---------------------------------------------------------------

    def count_episodes(self, chosen: np.ndarray, ended: np.ndarray) -> None:
        """Takes note that some worlds have ended an episode.

        Args:
            chosen: numbers of k worlds.
            ended: which of them, (k,) bool.
        """
        self.episodes[chosen] += ended

    def set_seeds(self, chosen: np.ndarray, seeds: np.ndarray) -> None:
        """Gives k worlds new seeds (k,), as in `seeds`, whose first episode comes next."""
        self.seeds[chosen] = seeds
        self.episodes[chosen] = 0

    def set_terrains(self, chosen: np.ndarray, terrains: Sequence[Terrain]) -> bool:
        """Puts k worlds on other terrains.

        Args:
            chosen: their numbers.
            terrains: k of them.

        Returns:
            Whether the terrains have more segments than the window held so far, so that the
            layout of the state must change.
        """
        assert self.terrains is not None
        for world, terrain in zip(chosen, terrains, strict=True):
            self.terrains[world] = terrain
        fresh = list(dict.fromkeys(terrains))
        points = max(len(terrain.xs) for terrain in fresh)
        if points > self.profiles.shape[1]:
            self._repack(int(_SPARE * points))
        else:
            rows = {t: padded(t, self.profiles.shape[1]) for t in fresh}
            table = torch.from_numpy(np.stack([rows[terrain] for terrain in terrains]))
            self.profiles[torch.from_numpy(chosen)] = table.to(self.profiles)
        needed = max(segments_within(t.xs, self.extent) for t in fresh)
        grows = needed > self.segments
        self.segments = max(self.segments, needed)
        return grows

    def _repack(self, points: int) -> None:
        """Makes room for terrains of so many points."""
        assert self.terrains is not None
        profiles = self.profiles.new_zeros(len(self.profiles), points, 2)
        rows = {terrain: padded(terrain, points) for terrain in set(self.terrains)}
        table = torch.from_numpy(np.stack([rows[terrain] for terrain in self.terrains]))
        profiles[: len(self.terrains)] = table.to(profiles)
        self.profiles = profiles

    # --- the first instant ----------------------------------------------------------------------

    def first_states(self, layout: Layout, chosen: np.ndarray) -> tuple[Tensor, Tensor]:
        """How some worlds at the start of their next episode differ from a `blank` one.

        Args:
            layout: where things lie in a world.
            chosen: numbers of k worlds.

        Returns:
            Numbers of the items in which they may, (I,), and the values of these, (k, I).
        """
        places = torch.arange(layout.items)
        voxels = places[: layout.header].unflatten(0, (-1, lay.VOXEL_ITEMS))
        header = places[layout.header :]
        bodies = voxels[:, : 4 * lay.BODY_ITEMS].unflatten(1, (4, lay.BODY_ITEMS))
        seeds = self._episode_seeds(chosen)
        numbers = np.stack(
            [self._lifetimes[chosen], seeds & 0xFFFF, seeds >> 16, *self._ground_ends(chosen)], 1
        )
        parts = [
            (bodies[..., :_POSE_ITEMS], self._first_poses(chosen)),
            (header[lay.H_LIFE : lay.H_GROUND_END + 1], torch.from_numpy(numbers)),
        ]
        if self._conditions is not None:
            own = np.stack([self._conditions.gravity[chosen], self._conditions.friction[chosen]], 1)
            springs = self._conditions.springs(chosen, self._morphology)
            parts += [
                (header[lay.H_GRAVITY : lay.H_FRICTION + 1], torch.from_numpy(own)),
                (voxels[:, lay.FIRMNESS : lay.ACTUATED + 1], torch.from_numpy(springs)),
            ]
        if self._damage is not None:
            times = self._damage_times(self._damage, chosen, seeds)
            parts.append((voxels[:, lay.BREAKS : lay.MENDS + 1], times))
        values = [each.to(self._like).flatten(1).expand(len(chosen), -1) for _, each in parts]
        return torch.cat([where.flatten() for where, _ in parts]), torch.cat(values, 1)

    def _ground_ends(self, chosen: np.ndarray) -> np.ndarray:
        """Where the grounds of k worlds start and end [m], (2, k)."""
        if self.terrains is None:
            return np.array([[-_FAR], [_FAR]]).repeat(len(chosen), 1)
        return np.array([self.terrains[world].xs[[0, -1]] for world in chosen]).reshape(-1, 2).T

    def blank(self, layout: Layout) -> Tensor:
        """The state of a place without a world, (layout.items,): one at rest that is over and has
        no robot."""
        if self._first is None or self._first[0] != layout:
            self._first = layout, st.blank(layout, self._like)
        return self._first[1]

    def _first_poses(self, chosen: np.ndarray) -> Tensor:
        """Where the robots of k worlds stand: x, y, angle, cosine, sine, (k or 1, V, 4, 5)."""
        terrains = [None] if self.terrains is None else [self.terrains[i] for i in chosen]
        numbers = {terrain: k for k, terrain in enumerate(dict.fromkeys(terrains))}
        table = self._poses_on(list(numbers))
        if len(numbers) == 1:
            return table
        return table[torch.from_numpy(np.array([numbers[terrain] for terrain in terrains]))]

    def _poses_on(self, terrains: Sequence[Terrain | None]) -> Tensor:
        """The same for robots on k different terrains, (k, V, 4, 5)."""
        new = [terrain for terrain in terrains if terrain not in self._poses]
        if new:
            if len(self._poses) > 2 * len(self.seeds) + 64:  # of terrains that are gone
                self._poses.clear()
                new = list(terrains)
            grounds = [terrain for terrain in new if terrain is not None]
            poses = torch.from_numpy(st.initial_poses(self._morphology, grounds or None, len(new)))
            angles = poses[..., 2:]
            poses = torch.cat([poses, angles.cos(), angles.sin()], -1)
            self._poses.update(zip(new, poses, strict=True))
        return torch.stack([self._poses[terrain] for terrain in terrains])

    def _episode_seeds(self, chosen: np.ndarray) -> np.ndarray:
        """Seeds of noise and damage in the next episode of k worlds, (k,) int64 in [0, 2^32)."""
        seeds, episodes = self.seeds[chosen], self.episodes[chosen]
        if not episodes.any():
            return seeds
        later = mixed(seeds.astype(np.uint64), episodes.astype(np.uint64))
        return np.where(episodes > 0, later, seeds)

    def _damage_times(self, damage: Damage, chosen: np.ndarray, seeds: np.ndarray) -> Tensor:
        """The steps at which voxels of k worlds break and mend, (k, V, 2)."""
        if self._mask is not None:
            broken = self._mask[chosen]
        else:
            n_voxels = self._morphology.n_voxels
            broken = np.stack([damage.sample(int(seed), n_voxels) for seed in seeds])
        start = float(clock.steps_in(damage.time))
        stop = clock.ENDLESS if math.isinf(damage.until) else float(clock.steps_in(damage.until))
        times = np.where(broken[..., None], [start, stop], clock.ENDLESS)
        return torch.from_numpy(times)
