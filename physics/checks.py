"""What a Simulator's arguments become: checked numbers, seeds of worlds, packed terrains."""

from __future__ import annotations

import math
import numbers
import operator
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor

from physics.engine.memory.state import ENDLESS
from physics.scene import clock
from physics.scene.terrain import Terrain

_PAD_STEP = 1e4  # distance of the points that make shorter profiles as long as the longest [m]
_ROUNDING = 0.01  # of abscissas, as float32 and float64 may differ [m]


def positive_integer(name: str, value: int) -> int:
    """The value, if it is an integer of at least 1."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 1:
        raise ValueError(f"{name}: expected an integer >= 1, got {value!r}")
    return int(value)


def finite(name: str, value: float, least: float = -math.inf) -> float:
    """The value, if it is a finite number not below ``least``."""
    if not (isinstance(value, numbers.Real) and math.isfinite(value) and value >= least):
        bound = "" if math.isinf(least) else f" >= {least:g}"
        raise ValueError(f"{name}: expected a finite number{bound}, got {value!r}")
    return float(value)


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
    positive_integer("lanes", value)
    if value & (value - 1):  # vectors of other lengths lie elsewhere than Taichi looks
        raise ValueError(f"lanes: expected a power of two, got {value!r}; leave it out")
    return value


def world_seeds(seed: int | Sequence[int], n_worlds: int) -> Tensor:
    """A seed for every world, (N,) int64 in [0, 2^32).

    From one integer, world i gets a mix of the integer and i; a sequence is mixed likewise,
    element by element, so that a world with seed s is the same at any place of any batch.
    """
    if isinstance(seed, Iterable):
        pairs = [(_seed(s), 0) for s in seed]
    else:
        pairs = [(_seed(seed), i) for i in range(n_worlds)]
    if len(pairs) != n_worlds:
        raise ValueError(f"seed: expected one integer or {n_worlds} of them, got {len(pairs)}")
    return torch.tensor([_mix(s, i) for s, i in pairs], dtype=torch.int64)


def _seed(value: Any) -> int:
    """The value, if it is an integer >= 0."""
    try:
        seed = operator.index(value)
    except TypeError:
        seed = -1
    if seed < 0:
        raise ValueError(f"seed: expected integers >= 0, got {value!r}")
    return seed


def _mix(seed: int, index: int) -> int:
    """32 bits that depend on all bits of both numbers (two rounds of splitmix64)."""
    mask = 2**64 - 1
    x = seed & mask
    for _ in range(2):
        x = (x + 0x9E3779B97F4A7C15 + index) & mask
        x = ((x ^ (x >> 30)) * 0xBF58476D1CE4E5B9) & mask
        x = ((x ^ (x >> 27)) * 0x94D049BB133111EB) & mask
        x ^= x >> 31
    return x >> 32


def lifetimes_in_steps(lifetime: float | Sequence[float] | None, n_worlds: int) -> Tensor:
    """Control steps that every world lives, (N,) float64."""
    if lifetime is None:
        return torch.full((n_worlds,), ENDLESS, dtype=torch.float64)
    seconds = list(lifetime) if isinstance(lifetime, Iterable) else [lifetime] * n_worlds
    if len(seconds) != n_worlds:
        raise ValueError(f"lifetime: expected one or {n_worlds} numbers [s], got {len(seconds)}")
    steps = [clock.steps_in(finite("lifetime", s, 0.0)) for s in seconds]
    return torch.tensor(steps, dtype=torch.float64)


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
    terrains: list[Terrain] | None, extent: float, places: int
) -> tuple[int, np.ndarray]:
    """Profiles as one array, and how many segments the window of a group must hold.

    Args:
        terrains: one per world, or None.
        extent: width of ground that a robot may need at once [m].
        places: worlds with the padding.

    Returns:
        Segments per window (0 without ground), and points (places, K, 2), float64.
    """
    if terrains is None:
        return 0, np.zeros((places, 2, 2))
    unique = {id(t): t for t in terrains}
    longest = max(len(t.xs) for t in unique.values())
    profiles = {key: _padded(t, longest) for key, t in unique.items()}
    packed = np.zeros((places, longest, 2))
    for world, terrain in enumerate(terrains):
        packed[world] = profiles[id(terrain)]
    segments = max(_segments_within(t.xs, extent) for t in unique.values())
    return segments, packed


def _padded(terrain: Terrain, points: int) -> np.ndarray:
    """The profile, with points of no height (NaN) at its end that nothing meets."""
    extra = points - len(terrain.xs)
    xs = np.concatenate([terrain.xs, terrain.xs[-1] + _PAD_STEP * np.arange(1, extra + 1)])
    ys = np.concatenate([terrain.ys, np.full(extra, np.nan)])
    return np.stack([xs, ys], axis=1)


def _segments_within(xs: np.ndarray, extent: float) -> int:
    """The most segments that an interval of this width can meet: the one it starts in, those that
    start within it, and one more because a window starts with an even segment."""
    reached = np.searchsorted(xs, xs + (extent + _ROUNDING), side="right") - np.arange(len(xs))
    return int(min(reached.max() + 2, len(xs)))
