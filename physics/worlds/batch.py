"""What the worlds of a batch start from: terrain, seed, episode, lifetime and damage of each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from physics.engine.memory.layout import Layout
from physics.scene.bodies import Bodies
from physics.scene.conditions import Conditions
from physics.scene.damage import Damage
from physics.scene.terrain import Terrain
from physics.worlds.first_states import FirstStates
from physics.worlds.prepared import Prepared
from physics.worlds.profiles import pack_terrains, padded
from physics.worlds.seeds import mixed
from physics.worlds.starts import Starts

__all__ = ["Batch"]

_SPARE = 1.25  # room that grows does so by this much more


class Batch:
    """N worlds, as they are when an episode begins.

    Attributes:
        terrains: one per world, or None without ground.
        profiles: their points, (places, K, 2), as kernels take them.
        segments: How many terrain segments the window of a group must hold; 0 without ground.
        first: how worlds begin.
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
        self._places = places
        self._prepared: dict[int, Prepared] = {}  # by worlds
        starts = Starts(bodies, extent, len(seeds), terrains is not None)
        self.first = FirstStates(bodies, starts, lifetimes, damages, conditions, like)
        self.segments, profiles = pack_terrains(terrains, extent, places, n_places)
        self.profiles = torch.from_numpy(profiles).to(like)

    def prepare(
        self, layout: Layout, chosen: np.ndarray, terrains: Sequence[Terrain] | None
    ) -> None:
        """Works out ahead how some worlds will begin the episodes after the present ones.

        Args:
            layout: where things lie in the state.
            chosen: numbers of k worlds.
            terrains: k terrains on which that will be; None: those of now.
        """
        grounds = self._terrains_of(chosen) if terrains is None else terrains
        profiles: list[np.ndarray | None] = [None] * len(chosen)
        if grounds is not None:
            profiles = [self._profile(terrain) for terrain in grounds]
            self.first.starts.segments(grounds)
        episodes = self.episodes[chosen] + 1
        drawn = self._episode_seeds(chosen, episodes)
        states = self.first.of_worlds(layout, chosen, drawn, grounds)
        for row, world in enumerate(chosen.tolist()):
            self._prepared[world] = Prepared(
                layout,
                int(self.seeds[world]),
                int(episodes[row]),
                None if grounds is None else grounds[row],
                states[row],
                profiles[row],
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
        room = self.profiles.shape[1]
        if points > room:
            self._repack(int(_SPARE * points))
        else:
            rows = self._prepared_profiles(chosen)
            rows.update((each, padded(each, room)) for each in fresh if each not in rows)
            self._put_profiles(chosen, np.stack([rows[terrain] for terrain in terrains]))
        needed = self.first.starts.segments(fresh)
        grows = needed > self.segments
        self.segments = max(self.segments, needed)
        return grows

    def _repack(self, points: int) -> None:
        """Makes room for terrains of so many points."""
        assert self.terrains is not None
        self.profiles = self.profiles.new_zeros(len(self.profiles), points, 2)
        rows = {terrain: padded(terrain, points) for terrain in set(self.terrains)}
        table = np.stack([rows[terrain] for terrain in self.terrains])
        self._put_profiles(np.arange(len(table)), table)

    def _put_profiles(self, chosen: np.ndarray, table: np.ndarray) -> None:
        """Writes the profiles of k worlds, (k, K, 2)."""
        places = self._places[chosen]
        if self.profiles.device.type == "cpu":  # numpy takes half the time for a single world
            self.profiles.numpy()[places] = table
        else:
            self.profiles[torch.from_numpy(places)] = torch.from_numpy(table).to(self.profiles)

    # --- the first instant ----------------------------------------------------------------------

    def first_states(self, layout: Layout, chosen: np.ndarray) -> Tensor:
        """The own items of some worlds at the start of their next episode.

        Args:
            layout: where things lie in it.
            chosen: numbers of k worlds.

        Returns:
            The `own_items` of each, (k, I).
        """
        terrains = self._terrains_of(chosen)
        states = self._prepared_states(layout, chosen, terrains)
        if states is None:
            drawn = self._episode_seeds(chosen, self.episodes[chosen])
            states = self.first.of_worlds(layout, chosen, drawn, terrains)
        return torch.from_numpy(states).to(self.profiles.device)

    def _terrains_of(self, chosen: np.ndarray) -> list[Terrain] | None:
        """The present terrains of some worlds; None without ground."""
        if self.terrains is None:
            return None
        return [self.terrains[world] for world in chosen.tolist()]

    def _profile(self, terrain: Terrain) -> np.ndarray | None:
        """Its points as they are written into the table, if there is room for them."""
        room = self.profiles.shape[1]
        return padded(terrain, room) if len(terrain.xs) <= room else None

    def _prepared_profiles(self, chosen: np.ndarray) -> dict[Terrain, np.ndarray]:
        """The profiles that were worked out for some worlds, and fit into the table."""
        found = (self._prepared.get(world) for world in chosen.tolist())
        return {
            each.terrain: each.profile
            for each in found
            if each is not None
            and each.terrain is not None
            and each.profile is not None
            and len(each.profile) == self.profiles.shape[1]
        }

    def _prepared_states(
        self, layout: Layout, chosen: np.ndarray, terrains: list[Terrain] | None
    ) -> np.ndarray | None:
        """`first_states`, if they were worked out before; they are given only once."""
        rows = []
        for row, world in enumerate(chosen.tolist()):
            ready = self._prepared.pop(world, None)
            now = int(self.seeds[world]), int(self.episodes[world])
            if ready and ready.fits(layout, *now, None if terrains is None else terrains[row]):
                rows.append(ready.values)
        return np.stack(rows) if len(rows) == len(chosen) else None

    def _episode_seeds(self, chosen: np.ndarray, episodes: np.ndarray) -> np.ndarray:
        """Seeds of noise and damage in episodes of k worlds, (k,) int64 in [0, 2^32)."""
        seeds = self.seeds[chosen]
        if not episodes.any():
            return seeds
        later = mixed(seeds.astype(np.uint64), episodes.astype(np.uint64))
        return np.where(episodes > 0, later, seeds)
