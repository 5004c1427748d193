"""The changing state of a batch of worlds, packed by groups as ``layout`` says.

Worlds fill the lanes of groups in order; the last group is filled up with worlds of zero
lifetime, which never move.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import torch
from torch import Tensor

from physics.backend import unpacked
from physics.engine.memory import layout as lay
from physics.engine.memory.layout import Layout
from physics.scene import material
from physics.scene.morphology import Morphology
from physics.scene.terrain import Terrain

_FAR = 1e30
START_X = 11.0  # left edge of a robot at the start [m]
START_HEIGHT = 1.0  # of its nearest voxel over the ground at the start [m]


@dataclass(frozen=True)
class State:
    """Tensors that a step changes.

    Attributes:
        items: (groups, layout.items, lanes), the float type of the simulation, their memory in
            the order of kernels (`backend.packed`).
        lists: contact and rope lists, (groups, layout.list_items), int32, likewise.
        layout: where things lie in them.
        n_worlds: N; the other lanes are padding.
        places: the place of each world, counted through all lanes, (N,) int64; None: in order.
    """

    items: Tensor
    lists: Tensor
    layout: Layout
    n_worlds: int
    places: Tensor | None = None

    @property
    def lanes(self) -> int:
        """Worlds per group."""
        return self.items.shape[2]

    def voxels(self, first: int, count: int = 1) -> Tensor:
        """View (groups, V, count, lanes) of items of the voxel blocks from ``first`` on."""
        blocks = self.items[:, : self.layout.header].unflatten(1, (-1, lay.VOXEL_ITEMS))
        return blocks[:, :, first : first + count]

    def bodies(self) -> Tensor:
        """View (groups, V, 4, BODY_ITEMS, lanes) of the squares."""
        return self.voxels(lay.BODIES, 4 * lay.BODY_ITEMS).unflatten(2, (4, lay.BODY_ITEMS))

    def header(self, item: int) -> Tensor:
        """View (groups, lanes) of an item of the header."""
        return self.items[:, self.layout.header + item]

    def steps(self) -> Tensor:
        """Steps that each world has taken, (N,) int64."""
        low, high = self.header(lay.H_STEP), self.header(lay.H_STEP_HIGH)
        return self.worlds(low.long() + high.long() * lay.STEPS_PER_HIGH)

    def of_worlds(self, numbers: np.ndarray, chosen: np.ndarray) -> np.ndarray:
        """Some items (I,) of some worlds (k,), from their numbers: (k, I)."""
        groups, lanes = (each[:, None] for each in np.divmod(self.place_of(chosen), self.lanes))
        if self.items.device.type == "cpu":
            return self.items.numpy()[groups, numbers, lanes]
        indices = (torch.from_numpy(each) for each in (groups, numbers, lanes))
        return self.items[tuple(indices)].cpu().numpy()

    def set_steps(self, steps: Tensor) -> None:
        """Sets the counters of all worlds, (N,) int64."""
        self.header(lay.H_STEP).copy_(self.lanes_of(steps % lay.STEPS_PER_HIGH))
        self.header(lay.H_STEP_HIGH).copy_(self.lanes_of(steps // lay.STEPS_PER_HIGH))

    def worlds(self, view: Tensor) -> Tensor:
        """(groups, ..., lanes) -> (N, ...), a copy without the padding."""
        if view.device.type == "cpu" and self.places is None:  # numpy takes half the time
            places = view.shape[0] * view.shape[-1]
            ordered = view.numpy().transpose(0, -1, *range(1, view.dim() - 1))
            copy = np.array(ordered, order="C").reshape(places, *ordered.shape[2:])
            return torch.from_numpy(
                copy if places == self.n_worlds else copy[: self.n_worlds].copy()
            )
        rows = view.movedim(-1, 1).flatten(0, 1)
        if self.places is not None:
            return rows[self.places]
        rows = rows[: self.n_worlds]
        if rows.untyped_storage().data_ptr() == view.untyped_storage().data_ptr():
            return rows.clone(memory_format=torch.contiguous_format)  # flatten gave a view
        return rows.contiguous()

    def place_of(self, chosen: np.ndarray) -> np.ndarray:
        """Places of some worlds, (k,), from their numbers."""
        return chosen if self.places is None else self.places.cpu().numpy()[chosen]

    def lanes_of(self, values: Tensor) -> Tensor:
        """(N, ...) -> (groups, ..., lanes) of the state's type, zeros in the padding."""
        groups, lanes = self.items.shape[0], self.lanes
        padding = values.new_zeros((groups * lanes - self.n_worlds, *values.shape[1:]))
        padded = torch.cat([values, padding]).to(self.items)
        if self.places is not None:
            padded = torch.zeros_like(padded).index_copy_(0, self.places, padded[: self.n_worlds])
        return padded.unflatten(0, (groups, lanes)).movedim(1, -1)


def allocate(
    layout: Layout,
    n_worlds: int,
    groups: int,
    lanes: int,
    dtype: torch.dtype,
    device: torch.device,
    places: Tensor | None = None,
) -> State:
    """An all-zero state for N worlds."""
    items = torch.zeros(groups, layout.items, lanes, dtype=dtype, device=device)
    lists = torch.zeros(groups, layout.list_items, dtype=torch.int32, device=device)
    return State(
        items=unpacked(items, lanes),
        lists=unpacked(lists, lanes),
        layout=layout,
        n_worlds=n_worlds,
        places=places,
    )


def blank(layout: Layout, like: Tensor) -> Tensor:
    """The items of a world without a robot in it, (layout.items,): nothing remembered, never
    damaged, over before its first step.

    Args:
        layout: where things lie.
        like: gives type and device.
    """
    items = torch.zeros(1, layout.items, 1, dtype=like.dtype, device=like.device)
    state = State(items, items, layout, 1)
    pairs = state.voxels(lay.PAIRS, 4 * lay.PAIRS_PER_BODY * lay.PAIR_ITEMS)
    pairs = pairs.unflatten(2, (-1, lay.PAIR_ITEMS))
    for point in range(2):
        pairs[:, :, :, lay.PA_POINTS + point * lay.POINT_ITEMS + lay.PT_DEPTH] = -1.0
    state.voxels(lay.BREAKS, 2).fill_(lay.NEVER)
    forget_window(state)
    return items.flatten()


def fill(state: State, blank: Tensor, own: Tensor, values: Tensor) -> None:
    """Makes all worlds anew.

    Args:
        state: changed in place.
        blank: items of the places without a world, (layout.items,).
        own: numbers of the items in which a world may differ from that, (I,) int64.
        values: of these items in every world, (N, I).
    """
    groups, lanes = state.items.shape[0], state.lanes
    rows = blank[own].repeat(groups * lanes, 1)
    rows[slice(state.n_worlds) if state.places is None else state.places] = values
    state.lists.zero_()
    for span in _used(state):
        state.items[:, span].copy_(blank[span, None])
    state.items[:, own] = rows.unflatten(0, (groups, lanes)).mT


def replace(state: State, chosen: np.ndarray, blank: Tensor, own: Tensor, values: Tensor) -> None:
    """Makes some worlds anew.

    Args:
        state: changed in place.
        chosen: numbers of k worlds.
        blank: as in `fill`.
        own: likewise.
        values: of their own items, (k, I).
    """
    groups, lanes = np.divmod(state.place_of(chosen), state.lanes)
    if state.items.device.type == "cpu":  # numpy takes half the time for a single world
        items, begin = state.items.numpy(), blank.numpy()
        for span in _used(state, groups):
            items[groups, span, lanes] = begin[span]
        items[groups[:, None], own.numpy(), lanes[:, None]] = values.numpy()
        return
    worlds = blank.repeat(len(chosen), 1)
    worlds[:, own] = values
    state.items[torch.from_numpy(groups), :, torch.from_numpy(lanes)] = worlds


def _used(state: State, groups: np.ndarray | None = None) -> tuple[slice, slice]:
    """Items that are read before they are written: all but self-contacts beyond those listed.

    Args:
        state: the state.
        groups: The groups that matter; None: all.
    """
    layout, counts = state.layout, state.lists[:, lay.L_SELF_CONTACTS]
    listed = counts if groups is None else counts[torch.from_numpy(groups)]
    first = layout.self_contact_block
    end = first + lay.SELF_CONTACT_ITEMS * int(listed.max())
    return slice(0, end), slice(layout.self_contact_bounds, layout.items)


def widened(state: State, layout: Layout) -> State:
    """The same worlds in a layout whose terrain window is larger; it is filled anew."""
    groups, old, lanes = state.items.shape
    items = state.items.new_zeros(groups, layout.items, lanes)
    items[:, : layout.window] = state.items[:, : layout.window]
    items[:, layout.rings :] = state.items[:, state.layout.rings : old]
    wider = State(unpacked(items, lanes), state.lists, layout, state.n_worlds, state.places)
    forget_window(wider)
    return wider


def set_poses(state: State, poses: Tensor) -> None:
    """Moves the squares to given poses (N, V, 4, 3); the caches of the poses follow."""
    bodies = state.bodies()
    lanes = state.lanes_of(poses.double().to(state.items.device))
    for item, source in ((lay.X, 0), (lay.Y, 1), (lay.ANGLE, 2)):
        bodies[:, :, :, item] = lanes[:, :, :, source]
    angles = poses[..., 2].double().to(state.items.device)
    bodies[:, :, :, lay.COS] = state.lanes_of(angles.cos())
    bodies[:, :, :, lay.SIN] = state.lanes_of(angles.sin())


def forget_window(state: State) -> None:
    """Makes the next look at the ground fill the terrain window anew."""
    state.header(lay.H_WINDOW_LOW).fill_(_FAR)
    state.header(lay.H_WINDOW_HIGH).fill_(-_FAR)


def level_poses(morphology: Morphology, ground: bool) -> np.ndarray:
    """Poses of the squares of a robot that stands upright, (V, 4, 3), float64.

    Voxel (gx, gy) is centred at (3 gx, 3 gy), and farther to the right on ground, where the robot's
    left edge is at START_X; how much higher is for `lift` to say.
    """
    cells = np.array(morphology.cells, dtype=np.float64) * material.VOXEL_SIDE
    signs = np.array(material.CORNER_SIGNS, dtype=np.float64)
    poses = np.zeros((len(cells), 4, 3))
    poses[..., :2] = cells[:, None] + signs * material.SQUARE_OFFSET
    if ground:
        poses[..., 0] += START_X + material.VOXEL_SIDE / 2
    return poses


def lift(morphology: Morphology, terrain: Terrain) -> float:
    """How much higher than in `level_poses` a robot starts on a terrain [m].

    As high as makes the least gap between a voxel's lowest point and the ground under its centre
    START_HEIGHT. If some square would be in the ground there, the least gap between a square and
    the ground anywhere under it is START_HEIGHT instead.
    """
    centers, bottoms, left, lowest = _columns(morphology)
    lifted = START_HEIGHT - float((bottoms - terrain.height(centers)).min())
    gap = float((lowest - terrain.highest(left, left + material.SQUARE_SIDE)).min())
    return lifted if lifted + gap >= 0 else START_HEIGHT - gap


@lru_cache(maxsize=64)
def _columns(morphology: Morphology) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Of a robot in `level_poses`: abscissas of the centres of its voxels, and heights of their
    lowest points; left edges of the columns of squares, and the lowest edge in each [m]."""
    half = material.VOXEL_SIDE / 2
    cells = np.array(morphology.cells, dtype=np.float64) * material.VOXEL_SIDE
    poses = level_poses(morphology, ground=True)
    left, column = np.unique(poses[..., 0].ravel() - material.SQUARE_HALF, return_inverse=True)
    lowest = np.full(len(left), np.inf)
    np.minimum.at(lowest, column, poses[..., 1].ravel() - material.SQUARE_HALF)
    return cells[:, 0] + START_X + half, cells[:, 1] - half, left, lowest
