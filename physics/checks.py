"""What a Simulator's arguments become: checked numbers, seeds of worlds, packed terrains."""

from __future__ import annotations

import math
import operator
import os
from collections.abc import Iterable, Sequence
from typing import Any, TypeGuard

import numpy as np
import torch
from torch import Tensor

from physics.scene import clock
from physics.scene.terrain import Terrain

_WORD = 2**64 - 1
_MOST_LANES = 32
_PAD_STEP = 1e4  # distance of the points that make shorter profiles as long as the longest [m]
_ROUNDING = 0.01  # of abscissas, as float32 and float64 may differ [m]


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
        name: of the argument that says how many.
        count: of things.
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


def chosen_worlds(name: str, mask: Any, n_worlds: int) -> np.ndarray:
    """The numbers of the worlds of a mask (N,), a bool tensor or array; of all for None."""
    if mask is None:
        return np.arange(n_worlds)
    flags = torch.from_numpy(mask) if isinstance(mask, np.ndarray) else mask
    if tensor(name, flags, worlds=n_worlds).dtype != torch.bool:
        raise ValueError(f"{name}: expected a bool mask, got {flags.dtype}")
    return np.flatnonzero(flags.cpu().numpy())


def world_seeds(seed: int | Sequence[int], n_worlds: int) -> np.ndarray:
    """A seed for every world, (N,) int64 in [0, 2^32).

    From one integer, world i gets a mix of the integer and i; a sequence is mixed likewise,
    element by element, so that a world with seed s is the same at any place of any batch.
    """
    if is_sequence(seed):
        seeds, indices = [_seed(s) for s in seed], np.zeros(1, dtype=np.uint64)
    else:
        seeds, indices = [_seed(seed)] * n_worlds, np.arange(n_worlds, dtype=np.uint64)
    if len(seeds) != n_worlds:
        raise ValueError(f"seed: expected one integer or {n_worlds} of them, got {len(seeds)}")
    return mixed(np.array([s & _WORD for s in seeds], dtype=np.uint64), indices)


def is_sequence(value: Any) -> TypeGuard[Iterable[Any]]:
    """Whether it holds several values; an array of no dimension, which is iterable, is one."""
    return isinstance(value, Iterable) and getattr(value, "ndim", 1) > 0


def _seed(value: Any) -> int:
    """The value, if it is an integer >= 0."""
    try:
        return integer("seed", value)
    except ValueError:
        raise ValueError(f"seed: expected integers >= 0, got {value!r}") from None


def mixed(seeds: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """32 bits that depend on all bits of both numbers (two rounds of splitmix64), element by
    element, int64.

    Args:
        seeds: uint64.
        indices: uint64, of the same shape or one that broadcasts to it.
    """
    x = seeds
    for _ in range(2):
        x = x + np.uint64(0x9E3779B97F4A7C15) + indices
        x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        x = x ^ (x >> np.uint64(31))
    return (x >> np.uint64(32)).astype(np.int64)


def lifetimes_in_steps(lifetime: float | Sequence[float] | None, n_worlds: int) -> np.ndarray:
    """Engine steps that every world lives, (N,) float64."""
    if lifetime is None:
        return np.full(n_worlds, clock.ENDLESS)
    seconds = list(lifetime) if is_sequence(lifetime) else [lifetime] * n_worlds
    if len(seconds) != n_worlds:
        raise ValueError(f"lifetime: expected one or {n_worlds} numbers [s], got {len(seconds)}")
    steps = [clock.steps_in(finite("lifetime", s, 0.0), "lifetime") for s in seconds]
    return np.array(steps, dtype=np.float64)


def terrain_list(
    terrain: Terrain | Sequence[Terrain] | None, n_worlds: int
) -> list[Terrain] | None:
    """One terrain per world, or None."""
    if terrain is None:
        return None
    if isinstance(terrain, Terrain):
        return [terrain] * n_worlds
    terrains: list[Any] = list(terrain) if isinstance(terrain, list | tuple) else [terrain]
    strange = [t for t in terrains if not isinstance(t, Terrain)]
    if strange:
        raise ValueError(
            f"terrain: expected physics.Terrain, got {strange[0]!r}; "
            "build one with Terrain.from_name or Terrain.from_profile"
        )
    if len(terrains) != n_worlds:
        raise ValueError(
            f"terrain: expected one Terrain, a list of {n_worlds} or None, got {len(terrains)}"
        )
    return terrains


def pack_terrains(
    terrains: list[Terrain] | None, extent: float, places: np.ndarray, n_places: int
) -> tuple[int, np.ndarray]:
    """Profiles as one array, and how many segments the window of a group must hold.

    Args:
        terrains: one per world, or None.
        extent: width of ground that a robot may need at once [m].
        places: where each world lies, (N,).
        n_places: all places, those without a world included.

    Returns:
        Segments per window (0 without ground), and points (n_places, K, 2), float64.
    """
    if terrains is None:
        return 0, np.zeros((n_places, 2, 2))
    unique = {id(t): t for t in terrains}
    longest = max(len(t.xs) for t in unique.values())
    profiles = {key: padded(t, longest) for key, t in unique.items()}
    packed = np.zeros((n_places, longest, 2))
    for place, terrain in zip(places, terrains, strict=True):
        packed[place] = profiles[id(terrain)]
    segments = max(segments_within(t.xs, extent) for t in unique.values())
    return segments, packed


def padded(terrain: Terrain, points: int) -> np.ndarray:
    """The profile, with points of no height (NaN) at its end that nothing meets."""
    own = len(terrain.xs)
    profile = np.empty((points, 2))
    profile[:own, 0], profile[:own, 1] = terrain.xs, terrain.ys
    if own < points:
        profile[own:, 0] = terrain.xs[-1] + _PAD_STEP * np.arange(1, points - own + 1)
        profile[own:, 1] = np.nan
    return profile


def segments_within(xs: np.ndarray, extent: float) -> int:
    """The most segments that an interval of this width can meet: the one it starts in, those that
    start within it, and one more because a window starts with an even segment."""
    reached = np.searchsorted(xs, xs + (extent + _ROUNDING), side="right") - np.arange(len(xs))
    return int(min(reached.max() + 2, len(xs)))
