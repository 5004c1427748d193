"""Several conditions taken together: what their medians, one by one, hide.

The interquartile mean, the mean probability of improvement and performance profiles are those that
Agarwal et al. recommend for few runs ("Deep reinforcement learning at the edge of the statistical
precipice", NeurIPS 2021). Intervals are percentile bootstraps, stratified: runs are drawn anew
within every condition. A failed episode (NaN) counts as minus infinity where that has a meaning,
and otherwise as the slowest of its condition.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from experiments.report.intervals import ALPHA, Estimate, resampling_seed, worst_first

__all__ = ["interquartile_mean", "mean_a12", "profile"]

Values = NDArray[np.float64]
_RESAMPLES = 2_000


def interquartile_mean(samples: Sequence[Values]) -> Estimate:
    """Mean of the middle half of all runs of some conditions, with its 95 % interval.

    Args:
        samples: one per condition, shape (runs,) each, in the same unit.

    Raises:
        ValueError: there are no values.
    """
    known = [_slowest_for_failed(each) for each in samples]
    return _bootstrap(known, lambda drawn: stats.trim_mean(np.concatenate(drawn, -1), 0.25, -1))


def mean_a12(pairs: Sequence[tuple[Values, Values]]) -> Estimate:
    """Mean over conditions of the probability that a run of the first is higher than one of the
    second (Vargha and Delaney's A12; ties count half), with its 95 % interval.

    Args:
        pairs: For every condition the values of the runs of both sides, shapes (n1,) and (n2,).

    Raises:
        ValueError: there are no values.
    """
    flat = [worst_first(sample) for pair in pairs for sample in pair]

    def statistic(drawn: Sequence[Values]) -> Values:
        each = [
            (_signs(x, y) + 1).mean((-2, -1)) / 2
            for x, y in zip(drawn[::2], drawn[1::2], strict=True)
        ]
        return np.mean(each, axis=0)

    return _bootstrap(flat, statistic)


def profile(samples: Sequence[Values], levels: Values) -> tuple[Values, Values, Values]:
    """The share of runs that are above each of some levels.

    Args:
        samples: one per condition, shape (runs,) each, in the same unit.
        levels: The levels at which the profile is computed, shape (K,).

    Returns:
        The shares and the lower and upper bounds of their 95 % intervals, shape (K,) each.

    Raises:
        ValueError: there are no values.
    """
    found = [
        _bootstrap(
            [worst_first(each) for each in samples],
            lambda drawn, level=level: (np.concatenate(drawn, -1) > level).mean(-1),  # type: ignore[misc]
        )
        for level in levels
    ]
    shares = np.array([[each.value, each.low, each.high] for each in found]).reshape(-1, 3)
    return shares[:, 0], shares[:, 1], shares[:, 2]


def _bootstrap(
    samples: Sequence[Values], statistic: Callable[[Sequence[Values]], Values]
) -> Estimate:
    """A statistic of several samples, and its interval when each is drawn anew.

    `statistic` takes samples of shape (..., n) each and returns shape (...).
    """
    if not samples or any(len(each) == 0 for each in samples):
        raise ValueError("values: expected at least one per condition, got an empty sample")
    rng = np.random.default_rng(resampling_seed())
    drawn = [each[rng.integers(len(each), size=(_RESAMPLES, len(each)))] for each in samples]
    low, high = np.quantile(statistic(drawn), [ALPHA / 2, 1 - ALPHA / 2])
    return Estimate(float(statistic(samples)), float(low), float(high))


def _signs(x: Values, y: Values) -> Values:
    """Of the differences of every value of x and every one of y; two failed ones are equal."""
    x, y = x[..., :, None], y[..., None, :]
    return np.where(x == y, 0.0, np.where(x > y, 1.0, -1.0))


def _slowest_for_failed(values: Values) -> Values:
    known = values[~np.isnan(values)]
    return np.where(np.isnan(values), known.min() if len(known) else 0.0, values)
