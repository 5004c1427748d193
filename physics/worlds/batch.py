"""What the worlds of a batch start from: terrain, seed, episode, lifetime and damage of each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import torch
from torch import Tensor

from physics.engine.memory import layout as lay
from physics.engine.memory import state as st
from physics.engine.memory.layout import Layout
from physics.scene import clock
from physics.scene.bodies import Bodies, Body
from physics.scene.conditions import Conditions
from physics.scene.damage import Damage
from physics.scene.terrain import Terrain
from physics.worlds.profiles import pack_terrains, padded, segments_within
from physics.worlds.seeds import mixed

__all__ = ["Batch", "varied"]

_POSE_ITEMS = lay.SIN + 1  # of a body: x, y, angle, cosine, sine
_FAR = 1e30  # where a world without ground ends [m]
_SPARE = 1.25  # room that grows does so by this much more

_SQUARES = 4 * lay.BODY_ITEMS
_SHARED = lay.BREAKS - _SQUARES  # items of a voxel, behind its squares, that begin alike everywhere
_OWN_VOXEL_ITEMS = lay.VOXEL_ITEMS - _SHARED


@lru_cache(maxsize=8)
def own_items(layout: Layout) -> Tensor:
    """Numbers of the items in which a world may begin otherwise than another, (I,): the squares,
    breaks and springs of each voxel, and the header."""
    own = np.r_[0:_SQUARES, lay.BREAKS : lay.VOXEL_ITEMS]
    voxels = np.arange(0, layout.header, lay.VOXEL_ITEMS)[:, None] + own
    header = np.arange(layout.header, layout.header + lay.HEADER_ITEMS)
    return torch.from_numpy(np.concatenate([voxels.ravel(), header]))


class Batch:
    """N worlds, as they are when an episode begins.

    Attributes:
        terrains: one per world, or None without ground.
        profiles: their points, (places, K, 2), as kernels take them.
        segments: How many terrain segments the window of a group must hold; 0 without ground.
        extent: width of that window [m].
        seeds: The seeds of noise and damage, (N,) int64 in [0, 2^32).
        episodes: that each world has ended since it got its seed, (N,) int64.
    """

    def __init__(
        self,
        bodies: Bodies,
        terrains: list[Terrain] | None,
        extent: float,
        seeds: np.ndarray,
        lifetimes: np.ndarray,
        damages: list[Damage | None] | None,
        conditions: Conditions,
        places: np.ndarray,
        n_places: int,
        like: Tensor,
    ) -> None:
        """Packs the terrains of N worlds.

        Args:
            bodies: The robots.
            terrains: N of them, or None.
            extent: width of ground that a robot may need at once, whatever its posture [m].
            seeds: The seeds of every world, (N,) int64 in [0, 2^32).
            lifetimes: The lengths of the episodes of every world, in engine steps, (N,) int64.
            damages: The damage of each world, N of them, if any.
            conditions: The conditions of all worlds.
            places: where each world lies, (N,).
            n_places: The number of places, those that fill up groups included.
            like: any tensor of the type and on the device of the state.

        Raises:
            ValueError: the damage has a mask for other voxels or worlds.
        """
        self.terrains = terrains
        self.seeds = seeds
        self.episodes = np.zeros(len(seeds), dtype=np.int64)
        self._bodies = bodies
        self._places = places
        self.extent = extent
        self._lifetimes = lifetimes
        self._damages = damages
        self._conditions = conditions if varied(conditions, bodies) else None
        self._like = like
        self._poses: dict[tuple[Body, Terrain | None], Tensor] = {}
        self._first: tuple[Layout, Tensor] | None = None
        self.segments, profiles = pack_terrains(terrains, extent, places, n_places)
        self.profiles = torch.from_numpy(profiles).to(like)
        self._masks = {
            each: each.broken_mask(len(seeds), bodies.n_voxels)
            for each in dict.fromkeys(damages or ())
            if each is not None and each.mask is not None
        }
        if self._masks and not bodies.alike:
            raise ValueError(
                "damage: expected no mask where worlds have different robots; give a probability"
            )

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
            chosen: The numbers of the k worlds.
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
            self.profiles[torch.from_numpy(self._places[chosen])] = table.to(self.profiles)
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
        profiles[torch.from_numpy(self._places)] = table.to(profiles)
        self.profiles = profiles

    # --- the first instant ----------------------------------------------------------------------

    def first_states(self, layout: Layout, chosen: np.ndarray) -> Tensor:
        """The own items of some worlds at the start of their next episode.

        Args:
            layout: where things lie in it.
            chosen: numbers of k worlds.

        Returns:
            The `own_items` of each, (k, I).
        """
        states = self.blank(layout)[own_items(layout)].repeat(len(chosen), 1)
        voxels = states[:, : -lay.HEADER_ITEMS].unflatten(1, (-1, _OWN_VOXEL_ITEMS))
        header = states[:, -lay.HEADER_ITEMS :]
        seeds = self._episode_seeds(chosen)
        life_high, life = np.divmod(self._lifetimes[chosen], lay.STEPS_PER_HIGH)
        numbers = np.stack([life, seeds & 0xFFFF, seeds >> 16, *self._ground_ends(chosen)], 1)
        header[:, lay.H_LIFE : lay.H_GROUND_END + 1] = torch.from_numpy(numbers).to(states)
        header[:, lay.H_LIFE_HIGH] = torch.from_numpy(life_high).to(states)
        if self._conditions is not None:
            pulls = np.stack(
                [self._conditions.gravity[chosen], self._conditions.friction[chosen]], 1
            )
            header[:, lay.H_GRAVITY : lay.H_FRICTION + 1] = torch.from_numpy(pulls).to(states)
        if self._damages is not None:
            high = np.array([_span(self._damages[world])[0] for world in chosen])
            header[:, lay.H_BREAKS_HIGH : lay.H_MENDS_HIGH + 1] = torch.from_numpy(high).to(states)
        for body, rows in self._bodies.among(chosen):
            robots = voxels[rows]
            self._write_robots(body, chosen[rows], seeds[rows], robots[:, : body.n_voxels])
            if not self._bodies.alike:
                robots[:, body.n_voxels :, :_SQUARES] = torch.nan  # there is no voxel
                voxels[rows] = robots
        return states

    def _write_robots(
        self, body: Body, chosen: np.ndarray, seeds: np.ndarray, voxels: Tensor
    ) -> None:
        """Writes the robots of some worlds, which are alike, into their voxels.

        Args:
            body: the robot.
            chosen: numbers of k worlds.
            seeds: of noise and damage in their next episode, (k,).
            voxels: their own items, (k, V, _OWN_VOXEL_ITEMS).
        """
        squares = voxels[:, :, :_SQUARES].unflatten(2, (4, lay.BODY_ITEMS))
        squares[..., :_POSE_ITEMS] = self._first_poses(body, chosen).to(voxels)
        if self._conditions is not None:
            springs = torch.from_numpy(self._conditions.springs(chosen, body.morphology))
            voxels[:, :, lay.FIRMNESS - _SHARED : lay.ACTUATED + 1 - _SHARED] = springs.to(voxels)
        if self._damages is not None:
            own = [self._damages[world] for world in chosen]
            times = self._damage_times(own, chosen, seeds, body.n_voxels)
            voxels[:, :, lay.BREAKS - _SHARED : lay.MENDS + 1 - _SHARED] = times.to(voxels)

    def _ground_ends(self, chosen: np.ndarray) -> np.ndarray:
        """Where the terrains of k worlds start and end [m], (2, k)."""
        if self.terrains is None:
            return np.array([[-_FAR], [_FAR]]).repeat(len(chosen), 1)
        return np.array([self.terrains[world].xs[[0, -1]] for world in chosen]).reshape(-1, 2).T

    def blank(self, layout: Layout) -> Tensor:
        """The state of a place without a world, (layout.items,): one at rest that is over and has
        no robot."""
        if self._first is None or self._first[0] != layout:
            self._first = layout, st.blank(layout, self._like)
        return self._first[1]

    def _first_poses(self, body: Body, chosen: np.ndarray) -> Tensor:
        """Where such robots of k worlds stand: x, y, angle, cosine, sine, (k or 1, V, 4, 5)."""
        terrains = [None] if self.terrains is None else [self.terrains[i] for i in chosen]
        numbers = {terrain: k for k, terrain in enumerate(dict.fromkeys(terrains))}
        table = self._poses_on(body, list(numbers))
        if len(numbers) == 1:
            return table
        return table[torch.from_numpy(np.array([numbers[terrain] for terrain in terrains]))]

    def _poses_on(self, body: Body, terrains: Sequence[Terrain | None]) -> Tensor:
        """The same for robots on k different terrains, (k, V, 4, 5)."""
        new = [terrain for terrain in terrains if (body, terrain) not in self._poses]
        if new:
            if len(self._poses) > 2 * len(self.seeds) + 64:  # of terrains that are gone
                self._poses.clear()
                new = list(terrains)
            known = [terrain for terrain in new if terrain is not None]
            poses = torch.from_numpy(st.initial_poses(body.morphology, known or None, len(new)))
            angles = poses[..., 2:]
            poses = torch.cat([poses, angles.cos(), angles.sin()], -1)
            self._poses.update(zip(((body, each) for each in new), poses, strict=True))
        return torch.stack([self._poses[body, terrain] for terrain in terrains])

    def _episode_seeds(self, chosen: np.ndarray) -> np.ndarray:
        """Seeds of noise and damage in the next episode of k worlds, (k,) int64 in [0, 2^32)."""
        seeds, episodes = self.seeds[chosen], self.episodes[chosen]
        if not episodes.any():
            return seeds
        later = mixed(seeds.astype(np.uint64), episodes.astype(np.uint64))
        return np.where(episodes > 0, later, seeds)

    def _damage_times(
        self,
        damages: Sequence[Damage | None],
        chosen: np.ndarray,
        seeds: np.ndarray,
        n_voxels: int,
    ) -> Tensor:
        """The steps at which voxels of k worlds break and mend, their lower digits, (k, V, 2)."""
        times = np.full((len(chosen), n_voxels, 2), lay.NEVER)
        for row, (damage, world, seed) in enumerate(zip(damages, chosen, seeds, strict=True)):
            if damage is None:
                continue
            mask = self._masks.get(damage)
            broken = damage.sample(int(seed), n_voxels) if mask is None else mask[world]
            times[row, broken] = _span(damage)[1]
        return torch.from_numpy(times)


def _span(damage: Damage | None) -> tuple[np.ndarray, list[float]]:
    """The steps at which voxels break and mend: higher digits, and lower ones."""
    if damage is None:
        return np.zeros(2, dtype=np.int64), [lay.NEVER, lay.NEVER]
    forever = math.isinf(damage.until)
    times = [clock.steps_in(damage.time), 0 if forever else clock.steps_in(damage.until)]
    high, low = np.divmod(np.array(times), lay.STEPS_PER_HIGH)
    return high, [float(low[0]), lay.NEVER if forever else float(low[1])]


def varied(conditions: Conditions, bodies: Bodies) -> bool:
    """Whether gravity, friction or springs differ among worlds or voxels."""
    return any(conditions.varied(body.morphology) for body in bodies.unlike)
