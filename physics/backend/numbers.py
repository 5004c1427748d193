"""The number type that a kernel is built for, and the kinds of its arguments."""

from __future__ import annotations

import functools
import operator
from typing import Any

import torch

from physics.backend.groups import Group
from physics.backend.language import ti, variable
from physics.backend.program import Program
from physics.backend.reading import keep_constants, lane_of

__all__ = ["GRAIN", "Real", "integers", "real"]

# A CPU range-for of Taichi is never split below this many iterations, so a loop over chunks runs
# as ``for q in range(GRAIN * chunks): if q % GRAIN == 0: ...  # chunk q // GRAIN``.
GRAIN = 512


class Real:
    """The number type a kernel is built for.

    Attributes:
        f: Taichi's scalar type; ``f(0.1)`` in a kernel is a literal of this type.
        vec: one value per lane.
        lanes: worlds of a group that are simulated.
        places: worlds of a group in memory.
        double: whether f is float64.
        features: stages of the engine that the kernel has.
        on_gpu: whether it runs on a GPU.
        block: threads of a block there.
    """

    _data_oriented = True  # lets Taichi pass it on as it is

    def __init__(self, program: Program) -> None:
        self.double = program.dtype == torch.float64
        self.f = ti.f64 if self.double else ti.f32
        self.vec = ti.types.vector(program.lanes, self.f)
        self.lanes = program.lanes
        self.places = program.places
        self.features = program.features
        self.on_gpu = program.device == "cuda"
        self.block = program.block

    @property
    def flags(self) -> Any:
        """One int32 per lane."""
        return ti.types.vector(self.lanes, ti.i32)

    @property
    def words(self) -> Any:
        """One uint32 per lane."""
        return ti.types.vector(self.lanes, ti.u32)

    @property
    def singles(self) -> Any:
        """One float32 per lane."""
        return ti.types.vector(self.lanes, ti.f32)

    @property
    def array(self) -> Any:
        """Kernel argument: lane vectors, a tensor of `Program.packed`. They are one row, group
        after group, or, with one lane, (items, groups). Kernels use it through `group`."""
        return ti.types.ndarray(dtype=self.vec, ndim=2 if self.lanes == 1 else 1)

    @property
    def narrow(self) -> bool:
        """Whether a group has places for more worlds than are simulated."""
        return self.lanes < self.places

    @property
    def grain(self) -> int:
        """Iterations of a parallel loop for each chunk of groups, see GRAIN."""
        return 1 if self.on_gpu else GRAIN

    def constants(self) -> int:
        """In a kernel: declares constants for what follows in this block, see `reading`. Returns
        how many."""
        return keep_constants(self.lanes, self.f)

    def union(self, flags: Any) -> Any:
        """In a kernel: the bits that are set in any lane."""
        return functools.reduce(operator.or_, (lane_of(flags, k) for k in range(self.lanes)))

    def group(self, array: Any, number: Any, items: Any, lists: Group | None = None) -> Group:
        """In a kernel: the items of a group.

        Args:
            array: an argument of the kernel that was declared as `array`.
            number: The number of the group.
            items: how many each group has.
            lists: the integers of the group, if it has any; see `lists`.
        """
        if self.lanes == 1:
            return Group(array, number, items, lambda item: (item, number), lists)
        start = variable(number * (items * (self.places // self.lanes)))
        mask = 2**31 // self.lanes - 1
        return Group(array, number, items, lambda item: ((start + item) & mask,), lists)

    def items(self, array: Any, group: Group) -> Any:
        """In a kernel: how many items a group has in an array, from those of a `group`."""
        if self.lanes == 1:
            return array.shape[0]
        parts = self.places // self.lanes
        return variable(array.shape[0] // (group.array.shape[0] // (group.items * parts)) // parts)

    def lists(self, array: Any, number: Any) -> Group:
        """In a kernel: the integers of a group.

        Args:
            array: an argument that was declared as `integers(2)`, a tensor of `packed`.
            number: The number of the group.
        """
        order = (lambda item: (item, number)) if self.places == 1 else (lambda item: (number, item))
        return Group(array, number, array.shape[0 if self.places == 1 else 1], order)

    def scalars(self, ndim: int) -> Any:
        """Kernel argument: a contiguous torch tensor of ndim dimensions."""
        return ti.types.ndarray(dtype=self.f, ndim=ndim)


def real(program: Program) -> Real:
    """The Real of a program.

    Raises:
        ValueError: its dtype is neither float32 nor float64.
    """
    if program.dtype not in (torch.float32, torch.float64):
        raise ValueError(
            f"dtype: expected torch.float32 or torch.float64, got {program.dtype}; choose one of "
            "these"
        )
    return Real(program)


def integers(ndim: int) -> Any:
    """Kernel argument: a contiguous int32 torch tensor of ndim dimensions."""
    return ti.types.ndarray(dtype=ti.i32, ndim=ndim)
