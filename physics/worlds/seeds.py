"""The seed of every world of a batch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from physics import checks

__all__ = ["mixed", "world_seeds"]

_WORD = 2**64 - 1


def world_seeds(seed: int | Sequence[int], n_worlds: int) -> np.ndarray:
    """A seed for every world, (N,) int64 in [0, 2^32).

    From one integer, world i gets a mix of the integer and i; a sequence is mixed likewise,
    element by element, so that a world with seed s is the same at any place of any batch.
    """
    if checks.is_sequence(seed):
        seeds, indices = [_seed(s) for s in seed], np.zeros(1, dtype=np.uint64)
    else:
        seeds, indices = [_seed(seed)] * n_worlds, np.arange(n_worlds, dtype=np.uint64)
    if len(seeds) != n_worlds:
        raise ValueError(f"seed: expected one integer or {n_worlds} of them, got {len(seeds)}")
    return mixed(np.array([s & _WORD for s in seeds], dtype=np.uint64), indices)


def _seed(value: Any) -> int:
    """The value, if it is an integer >= 0."""
    try:
        return checks.integer("seed", value)
    except ValueError:
        raise ValueError(f"seed: expected integers >= 0, got {value!r}") from None


def mixed(seeds: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """32 bits that depend on all bits of both numbers (two rounds of splitmix64), element by
    element, int64.

    Args:
        seeds: Seeds as uint64.
        indices: uint64, of the same shape or one that broadcasts to it.
    """
    x = seeds
    for _ in range(2):
        x = x + np.uint64(0x9E3779B97F4A7C15) + indices
        x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        x = x ^ (x >> np.uint64(31))
    return (x >> np.uint64(32)).astype(np.int64)
