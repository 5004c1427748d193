"""Medians and shifts of samples, with intervals that hold the true ones.

A failed episode (NaN) is worse than any speed: medians take it for minus infinity. Where a median
or a bound would be minus infinity by that, it is NaN.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

__all__ = [
    "ALPHA",
    "Estimate",
    "median",
    "median_bounds",
    "middle",
    "quartiles",
    "require_values",
    "resampling_seed",
    "resampling_with",
    "shift",
    "spread",
    "worst_first",
]

ALPHA = 0.05  # paper, Sec. IV
_RESAMPLES = 10_000
_seed: ContextVar[int] = ContextVar("resampling seed", default=0)

Values = NDArray[np.float64]


@dataclass(frozen=True)
class Estimate:
    """A number and the interval that holds the true one with the confidence asked for."""

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.value:.2f} [{self.low:.2f}, {self.high:.2f}]"


@contextmanager
def resampling_with(seed: int) -> Iterator[None]:
    """Within this context, bootstrap intervals are resampled with another seed than 0."""
    token = _seed.set(seed)
    try:
        yield
    finally:
        _seed.reset(token)


def resampling_seed() -> int:
    """The seed of bootstrap intervals: 0, or that of `resampling_with`."""
    return _seed.get()


def median(values: Values) -> Estimate:
    """Median with its 95 % percentile-bootstrap interval, which follows `resampling_with`.

    Below about six values such an interval is too narrow: it cannot reach beyond the values.

    Args:
        values: shape (n,), n >= 1.

    Raises:
        ValueError: there are no values.
    """
    x = worst_first(values)
    require_values(x)
    draws = np.random.default_rng(_seed.get()).integers(len(x), size=(_RESAMPLES, len(x)))
    # A quantile that is one of the medians: between -inf and a number there is nothing to take.
    medians = np.median(x[draws], axis=1)
    low, high = np.quantile(medians, [ALPHA / 2, 1 - ALPHA / 2], method="inverted_cdf")
    return Estimate(*(_or_nan(each) for each in (np.median(x), low, high)))


def median_bounds(values: Values, *, alpha: float = ALPHA) -> Estimate:
    """Median with an interval that assumes nothing, from the order of the values.

    The k-th smallest and k-th largest value, where k is the most that a fair coin allows. Fewer
    than six values leave the 95 % interval unbounded. A failed episode counts for the worst of
    either bound.

    Args:
        values: shape (n,), n >= 1.
        alpha: one minus the confidence of the interval.

    Raises:
        ValueError: there are no values.
    """
    x = np.asarray(values, dtype=np.float64)
    require_values(x)
    lows, highs = (np.sort(np.nan_to_num(x, nan=worst)) for worst in (-np.inf, np.inf))
    below = int((stats.binom.cdf(np.arange(len(x)), len(x), 0.5) <= alpha / 2).sum())
    bounds = (lows[below - 1], highs[-below]) if below else (-np.inf, np.inf)
    return Estimate(middle(x), float(bounds[0]), float(bounds[1]))


def middle(values: Values) -> float:
    """The median alone; NaN if it falls on a failed episode."""
    return _or_nan(np.median(worst_first(values)))


def quartiles(values: Values) -> tuple[float, float]:
    """The lower and the upper quartile; NaN where one falls on a failed episode."""
    with np.errstate(invalid="ignore"):  # between two failed ones there is nothing to take
        found = np.quantile(worst_first(values), (0.25, 0.75), method="median_unbiased")
    return _or_nan(found[0]), _or_nan(found[1])


def shift(first: Values, second: Values, *, alpha: float = ALPHA) -> Estimate:
    """How much higher the first sample is than the second (Hodges and Lehmann 1963).

    The value is the median of all differences between a value of the first and one of the second.
    The interval holds the shifts that the exact Mann-Whitney test does not reject at level alpha;
    it is unbounded if the runs are too few for the test to reject anything. Where a failed episode
    makes a difference undefined, the bounds take it for the worst.

    Args:
        first: shape (n1,), n1 >= 1.
        second: shape (n2,), n2 >= 1.
        alpha: one minus the confidence of the interval.

    Raises:
        ValueError: a sample is empty.
    """
    x, y = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    require_values(x, y)
    differences = (x[:, None] - y[None, :]).ravel()
    lows, highs = (np.sort(np.nan_to_num(differences, nan=worst)) for worst in (-np.inf, np.inf))
    # The test rejects a shift if at most this many differences are on its one side.
    rejected = int((np.cumsum(_u_counts(len(x), len(y))) <= alpha / 2).sum())
    bounds = (lows[rejected - 1], highs[-rejected]) if rejected else (-np.inf, np.inf)
    known = differences[~np.isnan(differences)]
    value = float(np.median(known)) if len(known) else float("nan")
    return Estimate(value, float(bounds[0]), float(bounds[1]))


def spread(values: Values) -> float:
    """Standard deviation of the values that are numbers (n - 1); NaN for fewer than two."""
    x = values[~np.isnan(values)]
    return float(x.std(ddof=1)) if len(x) > 1 else float("nan")


def worst_first(values: Values) -> Values:
    """The values with minus infinity for the failed."""
    return np.nan_to_num(
        np.asarray(values, dtype=np.float64), nan=-np.inf, posinf=np.inf, neginf=-np.inf
    )


def _or_nan(value: Any) -> float:
    return float(value) if np.isfinite(value) else float("nan")


def require_values(*samples: Values) -> None:
    """Refuse empty samples.

    Raises:
        ValueError: one is empty.
    """
    if any(len(each) == 0 for each in samples):
        raise ValueError("values: expected at least one per sample, got an empty sample")


def _u_counts(n_first: int, n_second: int) -> Values:
    """Probabilities of U = 0, 1, ..., n1 n2 if both samples come from one distribution.

    They are the coefficients of the Gaussian binomial, product of (1 - q^(n2 + i)) / (1 - q^i).
    """
    counts = np.zeros(n_first * n_second + 1)
    counts[0] = 1.0
    for i in range(1, n_first + 1):
        up = n_second + i
        counts[up:] = counts[up:] - counts[:-up] if up < len(counts) else counts[up:]
        for k in range(i, len(counts)):
            counts[k] += counts[k - i]
    return counts / counts.sum()
