"""Checks of arguments: numbers, tensors, devices. What is wrong is told by its name."""

from __future__ import annotations

import math
import operator
import os
from collections.abc import Iterable
from typing import Any, TypeGuard

import numpy as np
import torch
from torch import Tensor

_MOST_LANES = 32


def integer(name: str, value: Any, least: int = 0) -> int:
    """The value, if it is an integer of at least ``least``, of Python, NumPy or PyTorch."""
    try:
        found = least - 1 if isinstance(value, bool | np.bool_) else operator.index(value)
    except TypeError:
        found = least - 1
    if found < least:
        raise ValueError(f"{name}: expected an integer >= {least}, got {value!r}")
    return found


def positive_integer(name: str, value: Any) -> int:
    """The value, if it is an integer of at least 1."""
    return integer(name, value, 1)


def finite(name: str, value: Any, least: float = -math.inf) -> float:
    """The value, if it is a finite number not below ``least``, of Python, NumPy or PyTorch."""
    number = real(value)
    if not (math.isfinite(number) and number >= least):
        bound = "" if math.isinf(least) else f" >= {least:g}"
        raise ValueError(f"{name}: expected a finite number{bound}, got {value!r}")
    return number


def real(value: Any) -> float:
    """The value as a float; NaN if it is no single number."""
    if isinstance(value, str | bytes | bool | np.bool_) or getattr(value, "ndim", 0) > 0:
        return math.nan
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        return math.nan


def require_memory(name: str, count: int, bytes_each: int) -> None:
    """Refuse more things than the memory of this machine holds.

    Args:
        name: The name of the argument that says how many.
        count: The number of things.
        bytes_each: the least that one takes.
    """
    pages, page_size = os.sysconf("SC_PHYS_PAGES"), os.sysconf("SC_PAGE_SIZE")
    if count * bytes_each > pages * page_size:
        raise ValueError(
            f"{name}: expected at most {pages * page_size // bytes_each}, which fill the "
            f"{pages * page_size / 2**30:.0f} GiB of memory here, got {count}"
        )


def instance(name: str, value: Any, kind: type) -> Any:
    """The value, if it is None or of this class."""
    if not (value is None or isinstance(value, kind)):
        raise ValueError(f"{name}: expected physics.{kind.__name__} or None, got {value!r}")
    return value


def tensor(name: str, value: Any, **sizes: int | None) -> Tensor:
    """The value, if it is a tensor with these sizes; a size of None may be any."""
    wanted = tuple(sizes.values())
    if isinstance(value, Tensor) and value.shape == wanted:  # which is soon seen
        return value
    shape = tuple(value.shape) if isinstance(value, Tensor) else None
    if (
        shape is None
        or len(shape) != len(wanted)
        or any(want not in (have, None) for have, want in zip(shape, wanted, strict=True))
    ):
        words = ", ".join(key if size is None else f"{key}={size}" for key, size in sizes.items())
        got = type(value).__name__ if shape is None else f"shape {shape}"
        raise ValueError(f"{name}: expected a tensor of shape ({words}), got {got}")
    return value


def finite_numbers(name: str, values: Tensor) -> None:
    """Raises unless all numbers of a tensor are finite. Their sum is looked at first, which is
    not finite if one of them is not, and is cheap."""
    if not math.isfinite(values.sum().item()) and not bool(torch.isfinite(values).all()):
        raise ValueError(f"{name}: expected finite numbers, got NaN or infinity")


def device(spec: str | torch.device) -> torch.device:
    """The torch device, if the simulator runs there."""
    try:
        chosen = torch.device(spec)
    except (RuntimeError, TypeError):  # torch knows no such device
        chosen = None
    if chosen is None or chosen.type not in ("cpu", "cuda"):
        raise ValueError(f'device: expected "cpu" or "cuda", got {spec!r}')
    if chosen.type == "cuda" and not torch.cuda.is_available():
        raise ValueError(f'device: expected "cpu", for PyTorch finds no GPU here, got {spec!r}')
    if chosen.type == "cuda" and _gpu_number(chosen) != 0:
        raise ValueError(
            f'device: expected "cuda:0", the GPU that Taichi uses, got {spec!r} which is '
            f"cuda:{_gpu_number(chosen)}; choose another GPU with CUDA_VISIBLE_DEVICES"
        )
    return chosen


def _gpu_number(device: torch.device) -> int:
    return torch.cuda.current_device() if device.index is None else device.index


def lanes(value: int, device_type: str) -> int:
    """The value, if a program with so many worlds per group runs on the device."""
    if device_type == "cuda" and value != 1:
        raise ValueError(f"lanes: expected 1 on a GPU, got {value!r}; leave it out")
    value = positive_integer("lanes", value)
    # Vectors of other lengths lie elsewhere than Taichi looks; long ones take minutes to compile.
    if value > _MOST_LANES or value & (value - 1):
        raise ValueError(
            f"lanes: expected a power of two up to {_MOST_LANES}, got {value!r}; leave it out"
        )
    return value


def is_sequence(value: Any) -> TypeGuard[Iterable[Any]]:
    """Whether it holds several values; an array of no dimension, which is iterable, is one."""
    return isinstance(value, Iterable) and getattr(value, "ndim", 1) > 0
