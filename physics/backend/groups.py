"""The items of a group of worlds, as kernels index them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from physics.backend.language import impl, variable

__all__ = ["Block", "Group"]


class Group:
    """The items of a group in a kernel's array, indexed as ``[item]``.

    It exists while a kernel is compiled only, and leaves no trace in it.

    Taichi adds indices as 32-bit integers of which it promises LLVM nothing. Unless LLVM knows
    that a sum stays below 2^31, it has to compute every address from its own sum, one by one: of
    the instructions for the springs of a voxel, two fifths. So the place of a block of items is
    one masked number, which is surely small, and its items lie at constants behind it: these become
    part of the instruction that loads or stores.

    Attributes:
        array: The array of the kernel, with all groups.
        number: The number of the group.
        items: how many it has.
        at: ``at[item]`` is the `Block` of the items from this one on.
        lists: the integers of the group, if it has any: another `Group`.
    """

    _data_oriented = True  # lets Taichi pass it on as it is

    def __init__(
        self,
        array: Any,
        number: Any,
        items: Any,
        address: Callable[[Any], tuple[Any, ...]],
        lists: Group | None = None,
    ) -> None:
        self.array = array
        self._address = address
        self.number = number
        self.items = items
        self.lists = lists
        self.at = _Blocks(array, address)

    def __getitem__(self, item: Any) -> Any:
        return impl.subscript(None, self.array, *self._address(item))


class _Blocks:
    """Of a group, by their first items."""

    def __init__(self, array: Any, address: Callable[[Any], tuple[Any, ...]]) -> None:
        self._array = array
        self._address = address

    def __getitem__(self, item: Any) -> Block:
        first, *group = self._address(item)
        return Block(self._array, variable(first), *group)


class Block:
    """Items of a group from one of them on, the first as ``[0]``; see `Group`."""

    _data_oriented = True

    def __init__(self, array: Any, first: Any, *group: Any) -> None:
        self._array = array
        self._first = first
        self._group = group

    def __getitem__(self, item: Any) -> Any:
        return impl.subscript(None, self._array, self._first + item, *self._group)
