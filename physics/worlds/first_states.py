"""The items of worlds at the start of an episode."""

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
from physics.scene.bodies import Bodies
from physics.scene.conditions import Conditions
from physics.scene.damage import Damage
from physics.scene.terrain import Terrain
from physics.worlds.starts import START_ITEMS, Starts

__all__ = ["FirstStates", "own_items", "varied"]

_FAR = 1e30  # where a world without ground ends [m]

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


class FirstStates:
    """What N worlds are at the start of an episode, given its seed and terrain.

    Attributes:
        starts: where robots start on terrains.
    """

    def __init__(
        self,
        bodies: Bodies,
        starts: Starts,
        lifetimes: np.ndarray,
        damages: list[Damage | None] | None,
        conditions: Conditions,
        like: Tensor,
    ) -> None:
        """Takes what stays the same in all episodes; for the arguments see `Batch`."""
        self.starts = starts
        self._bodies = bodies
        self._lifetimes = lifetimes
        self._damages = damages
        self._conditions = conditions if varied(conditions, bodies) else None
        self._like = like
        self._first: tuple[Layout, Tensor, np.ndarray] | None = None
        self._masks = {
            each: each.broken_mask(len(lifetimes), bodies.n_voxels)
            for each in dict.fromkeys(damages or ())
            if each is not None and each.mask is not None
        }
        if self._masks and not bodies.alike:
            raise ValueError(
                "damage: expected no mask where worlds have different robots; give a probability"
            )

    def of_worlds(
        self,
        layout: Layout,
        chosen: np.ndarray,
        seeds: np.ndarray,
        terrains: Sequence[Terrain] | None,
    ) -> np.ndarray:
        """The own items of some worlds.

        Args:
            layout: where things lie in the state.
            chosen: numbers of k worlds.
            seeds: of noise and damage in their episodes, (k,) int64 in [0, 2^32).
            terrains: where they stand, k of them; None: without ground.

        Returns:
            The `own_items` of each, (k, I), in the state's type.
        """
        states = self._blanks(layout)[1][None].repeat(len(chosen), 0)
        voxels = states[:, : -lay.HEADER_ITEMS].reshape(len(chosen), -1, _OWN_VOXEL_ITEMS)
        header = states[:, -lay.HEADER_ITEMS :]
        header[:, lay.H_LIFE_HIGH], header[:, lay.H_LIFE] = np.divmod(
            self._lifetimes[chosen], lay.STEPS_PER_HIGH
        )
        header[:, lay.H_SEED_LOW], header[:, lay.H_SEED_HIGH] = seeds & 0xFFFF, seeds >> 16
        header[:, lay.H_GROUND_START : lay.H_GROUND_END + 1] = _ground_ends(terrains)
        if self._conditions is not None:
            header[:, lay.H_GRAVITY] = self._conditions.gravity[chosen]
            header[:, lay.H_FRICTION] = self._conditions.friction[chosen]
        if self._damages is not None:
            high = np.array([_span(self._damages[world])[0] for world in chosen])
            header[:, lay.H_BREAKS_HIGH : lay.H_MENDS_HIGH + 1] = high
        for robot, rows in self._bodies.among(chosen):
            own = voxels[rows]
            count = self._bodies.unlike[robot].n_voxels
            grounds = terrains
            if isinstance(rows, np.ndarray) and terrains is not None:
                grounds = [terrains[row] for row in rows]
            self._write_robots(robot, chosen[rows], seeds[rows], grounds, own[:, :count])
            if not self._bodies.alike:
                own[:, count:, :_SQUARES] = np.nan  # there is no voxel
                voxels[rows] = own
        return states

    def _write_robots(
        self,
        robot: int,
        chosen: np.ndarray,
        seeds: np.ndarray,
        terrains: Sequence[Terrain] | None,
        voxels: np.ndarray,
    ) -> None:
        """Writes the robots of some worlds, which are alike, into their voxels.

        Args:
            robot: The number of the robot among those that differ.
            chosen: numbers of k worlds.
            seeds: of their episodes, (k,).
            terrains: where they stand, k of them; None: without ground.
            voxels: their own items, (k, V, _OWN_VOXEL_ITEMS).
        """
        body = self._bodies.unlike[robot]
        level = self.starts.level(robot)
        squares = voxels[:, :, :_SQUARES].reshape(*voxels.shape[:2], 4, lay.BODY_ITEMS)
        squares[..., :START_ITEMS] = level
        if terrains is not None:
            lifts = self.starts.lifts(robot, terrains)
            squares[..., lay.Y] = level[..., lay.Y] + lifts[:, None, None]
        if self._conditions is not None:
            springs = self._conditions.springs(chosen, body.morphology)
            voxels[:, :, lay.FIRMNESS - _SHARED : lay.ACTUATED + 1 - _SHARED] = springs
        if self._damages is not None:
            damages = [self._damages[world] for world in chosen]
            times = self._damage_times(damages, chosen, seeds, body.n_voxels)
            voxels[:, :, lay.BREAKS - _SHARED : lay.MENDS + 1 - _SHARED] = times

    def blank(self, layout: Layout) -> Tensor:
        """The state of a place without a world, (layout.items,): one at rest that is over and has
        no robot."""
        return self._blanks(layout)[0]

    def _blanks(self, layout: Layout) -> tuple[Tensor, np.ndarray]:
        """`blank`, and its `own_items` (I,)."""
        if self._first is None or self._first[0] != layout:
            blank = st.blank(layout, self._like)
            self._first = layout, blank, blank.cpu()[own_items(layout)].numpy()
        return self._first[1:]

    def _damage_times(
        self,
        damages: Sequence[Damage | None],
        chosen: np.ndarray,
        seeds: np.ndarray,
        n_voxels: int,
    ) -> np.ndarray:
        """The steps at which voxels of k worlds break and mend, their lower digits, (k, V, 2)."""
        times = np.full((len(chosen), n_voxels, 2), lay.NEVER)
        for row, (damage, world, seed) in enumerate(zip(damages, chosen, seeds, strict=True)):
            if damage is None:
                continue
            mask = self._masks.get(damage)
            broken = damage.sample(int(seed), n_voxels) if mask is None else mask[world]
            times[row, broken] = _span(damage)[1]
        return times


def _ground_ends(terrains: Sequence[Terrain] | None) -> np.ndarray:
    """Where k terrains start and end [m], (k, 2)."""
    if terrains is None:
        return np.array([-_FAR, _FAR])
    return np.array([(terrain.xs[0], terrain.xs[-1]) for terrain in terrains])


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
