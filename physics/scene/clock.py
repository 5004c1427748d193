"""Simulated time: an accumulated sum of control steps, as in the reference simulator.

Time is ``DT + DT + ...`` in float64, so that 30 s are 1801 control steps and not 1800, and a
sensor's window sometimes holds one sample more or less than ``interval / DT``.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from physics.scene.material import DT

__all__ = ["steps_in", "times", "window_lengths"]


@lru_cache
def steps_in(duration: float) -> int:
    """Control steps of a life: ``t = 0; while t < duration: t += DT``.

    Args:
        duration: length of the life [s], finite and not negative.

    Raises:
        ValueError: if the duration is negative or not finite.
    """
    if not (math.isfinite(duration) and duration >= 0):
        raise ValueError(f"duration: expected a finite number of seconds >= 0, got {duration!r}")
    steps, time = 0, 0.0
    while time < duration:
        time += DT
        steps += 1
    return steps


def times(n: int) -> np.ndarray:
    """Times after the first n control steps [s], shape (n,), float64, accumulated."""
    return np.cumsum(np.full(n, DT))  # numpy's cumsum adds one by one, like the clock itself


def window_lengths(n: int, interval: float) -> np.ndarray:
    """Samples that a sensor averaging over the last ``interval`` seconds holds at each step.

    At step k (from 1; element k - 1) these are the samples j <= k with
    ``t_j >= t_k - interval``: 15-16 for 0.25 s, 30-31 for 0.5 s, fewer at the start.

    Args:
        n: number of control steps.
        interval: length of the window [s], not negative.

    Returns:
        Lengths, shape (n,), int64, each >= 1.

    Raises:
        ValueError: if the interval is negative or not a number.
    """
    if not interval >= 0:
        raise ValueError(f"interval: expected seconds >= 0, got {interval!r}")
    t = times(n)
    oldest = np.searchsorted(t, t - interval, side="left")
    return np.arange(1, n + 1) - oldest
