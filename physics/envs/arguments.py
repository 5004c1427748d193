"""Arguments of environments, checked; and the spaces that follow from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from gymnasium.spaces import Box

from physics import checks
from physics.simulator import Simulator

__all__ = ["choice", "reset_mask", "seeds_of_worlds", "spaces"]


def choice(name: str, value: Any, allowed: tuple[Any, ...]) -> Any:
    """The value, if it is one of these."""
    if value not in allowed:
        raise ValueError(f"{name}: expected one of {', '.join(map(str, allowed))}, got {value!r}")
    return value


def seeds_of_worlds(seed: int | Sequence[int | None], num_envs: int) -> list[int | None]:
    """A seed for every world, from one or from a sequence."""
    if not checks.is_sequence(seed) or isinstance(seed, str):
        first = checks.integer("seed", seed)
        return [first + world for world in range(num_envs)]
    seeds = [None if each is None else checks.integer("seed", each) for each in seed]
    if len(seeds) != num_envs:
        raise ValueError(f"seed: expected one or {num_envs} of them, got {len(seeds)}")
    return seeds


def reset_mask(options: Mapping[str, Any] | None) -> Any:
    """The mask in the options of a reset; None without one."""
    if unknown := sorted(set(options or {}) - {"reset_mask"}):
        raise ValueError(f"options: expected no other than 'reset_mask', got {unknown[0]!r}")
    return (options or {}).get("reset_mask")


def spaces(sim: Simulator, noise: float | Mapping[str, float]) -> tuple[Box, Box]:
    """Spaces of one world's observations and actions. Readings are in [0, 1] without noise."""
    dtype: Any = torch.empty(0, dtype=sim.dtype).numpy().dtype
    noisy = any(noise.values()) if isinstance(noise, Mapping) else noise > 0
    low, high = (-np.inf, np.inf) if noisy else (0.0, 1.0)
    return Box(low, high, (sim.n_readings,), dtype), Box(-1.0, 1.0, (sim.n_voxels,), dtype)
