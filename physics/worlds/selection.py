"""Arguments that are one for all worlds or one for each, as one for each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch

from physics import checks
from physics.scene import clock
from physics.scene.terrain import Terrain

__all__ = ["chosen_worlds", "lifetimes_in_steps", "terrain_list"]


def chosen_worlds(name: str, mask: Any, n_worlds: int) -> np.ndarray:
    """The numbers of the worlds of a mask (N,), a bool tensor or array; of all for None."""
    if mask is None:
        return np.arange(n_worlds)
    if isinstance(mask, np.ndarray) and mask.shape == (n_worlds,) and mask.dtype == bool:
        return np.flatnonzero(mask)
    flags = torch.from_numpy(mask) if isinstance(mask, np.ndarray) else mask
    if checks.tensor(name, flags, worlds=n_worlds).dtype != torch.bool:
        raise ValueError(f"{name}: expected a bool mask, got {flags.dtype}")
    return np.flatnonzero(flags.cpu().numpy())


def lifetimes_in_steps(lifetime: float | Sequence[float] | None, n_worlds: int) -> np.ndarray:
    """Length of the episode of every world in engine steps, (N,) int64."""
    if lifetime is None:
        return np.full(n_worlds, clock.MOST_STEPS)
    seconds = list(lifetime) if checks.is_sequence(lifetime) else [lifetime] * n_worlds
    if len(seconds) != n_worlds:
        raise ValueError(f"lifetime: expected one or {n_worlds} numbers [s], got {len(seconds)}")
    steps = [clock.steps_in(checks.finite("lifetime", s, 0.0), "lifetime") for s in seconds]
    return np.array(steps, dtype=np.int64)


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
