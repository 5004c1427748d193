"""What a kernel is compiled for, and how tensors lie in memory for it."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

__all__ = ["Features", "Program", "packed", "unpacked"]


class Features(NamedTuple):
    """Stages of the engine that a kernel has only if asked for: each costs time in every step."""

    self_collision: bool = False
    """Squares of a robot collide with each other."""
    continuous: bool = False
    """Squares that land are stopped where they touch the ground."""
    varied: bool = False
    """Gravity, friction and springs are those of each world and voxel, not the same for all."""


class Program(NamedTuple):
    """What a kernel is compiled for.

    Attributes:
        dtype: torch.float32 or torch.float64.
        lanes: worlds of a group that it simulates: all, or the first ones (see ``narrow``).
        places: worlds of a group in memory, a multiple of lanes.
        features: see `Features`.
        device: "cpu" or "cuda".
        block: On a GPU, threads of a block.
    """

    dtype: torch.dtype
    lanes: int
    places: int
    features: Features = Features()
    device: str = "cpu"
    block: int = 32

    def packed(self, items: Tensor) -> Tensor:
        """A tensor (groups, items, places), its memory in the order of kernels, as this program
        takes it: a view, in vectors of its lanes; see `Real.array`."""
        if self.lanes == 1:
            return packed(items, 1)
        return items.view(-1, self.lanes)


def packed(items: Tensor, lanes: int) -> Tensor:
    """A tensor of groups and items, (groups, items, ...), as kernels take it: a view, contiguous
    if its memory is in that order, as that of `unpacked` tensors is."""
    return items.transpose(0, 1) if lanes == 1 else items


def unpacked(items: Tensor, lanes: int) -> Tensor:
    """The same values (groups, items, ...), with their memory in the order of kernels."""
    return packed(packed(items, lanes).contiguous(), lanes)  # a transposition undoes itself
