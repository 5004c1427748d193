"""Simulated time: an accumulated sum of control steps, as in the reference simulator.

Time is ``DT + DT + ...`` in float64, so that 30 s are 1801 control steps and not 1800, and a
sensor's window sometimes holds one sample more or less than ``interval / DT``.
"""

from __future__ import annotations

import bisect
import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from physics.scene.material import DT

__all__ = [
    "MOST_STEPS",
    "steps_in",
    "time_after",
    "times",
    "times_after",
    "window_changes",
    "window_lengths",
]

MOST_STEPS = 2**31
"""Steps that a world can take, 414 days of simulated time."""

_EXPLICIT = 128  # first steps that are added up one by one: the sum has not reached 4 s then


class _Stretch(NamedTuple):
    """Steps between two powers of two of the time, where every step adds the same."""

    step: int
    """The first one."""
    time: float
    """After it [s]."""
    increment: float
    """DT, rounded to what the time can represent there [s]."""


@lru_cache
def _stretches() -> tuple[_Stretch, ...]:
    """All stretches up to MOST_STEPS, the first steps one by one.

    From 1 s on, DT never lies half way between two numbers that the time could become (its last
    bit is set), so that rounding does not depend on the time.
    """
    found = [_Stretch(0, 0.0, DT)]
    while found[-1].step < MOST_STEPS:
        step, time, increment = found[-1]
        if step >= _EXPLICIT:
            end = 2.0 ** math.frexp(time)[1]
            count = math.ceil((end - time) / increment) - 1  # all exact: end is a power of two
            step, time = step + count, time + count * increment
        step, time = step + 1, time + DT
        found.append(_Stretch(step, time, time + DT - time))
    return tuple(found)


def times_after(steps: np.ndarray) -> np.ndarray:
    """Times after some steps [s]: the accumulated sum, without adding up.

    Args:
        steps: integers in [0, MOST_STEPS], any shape.
    """
    firsts, begins, increments = (np.array(column) for column in zip(*_stretches(), strict=True))
    place = np.searchsorted(firsts, steps, side="right") - 1
    return begins[place] + (steps - firsts[place]) * increments[place]


def time_after(steps: int) -> float:
    """The time after some steps [s], see `times_after`."""
    return float(times_after(np.array(steps)))


def steps_in(duration: float, name: str = "duration") -> int:
    """Control steps of an episode: ``t = 0; while t < duration: t += DT``.

    Args:
        duration: length of the episode [s], finite and not negative.
        name: The name of the argument, for the message of an error.

    Raises:
        ValueError: if the duration is negative, not finite or longer than MOST_STEPS.
    """
    if not (math.isfinite(duration) and duration >= 0):
        raise ValueError(f"{name}: expected a finite number of seconds >= 0, got {duration!r}")
    longest = time_after(MOST_STEPS)
    if duration > longest:
        raise ValueError(
            f"{name}: expected at most {longest:.0f} s, which are 2^31 steps, got {duration!r}"
        )
    stretches = _stretches()
    place = max(0, bisect.bisect_left([each.time for each in stretches], duration) - 1)
    step, time, increment = stretches[place]
    steps = step + max(0, math.ceil((duration - time) / increment))
    while time_after(steps) < duration:
        steps += 1
    while steps and time_after(steps - 1) >= duration:
        steps -= 1
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


def window_changes(after: int, interval: float) -> tuple[np.ndarray, np.ndarray]:
    """`window_lengths` beyond the first steps, up to MOST_STEPS: they seldom change.

    Where every step adds the same to the time, all full windows hold as many samples.

    Args:
        after: number of first steps, more than a window holds.
        interval: length of the window [s].

    Returns:
        Steps from which windows have another length, the first one being ``after`` + 1, and those
        lengths: int64, both of shape (changes,).
    """
    samples = math.ceil(interval / DT) + 2
    turns = [stretch.step for stretch in _stretches() if after < stretch.step <= MOST_STEPS]
    near = np.add.outer([after + 1, *turns], np.arange(samples + 1)).ravel()
    steps = np.unique(np.minimum(near, MOST_STEPS))
    own = times_after(steps)
    earlier = times_after(steps[:, None] - np.arange(samples))
    lengths = (earlier >= own[:, None] - interval).sum(1)
    changes = np.concatenate([[True], lengths[1:] != lengths[:-1]])
    return steps[changes], lengths[changes]
