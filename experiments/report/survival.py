"""When something happens for the first time, in runs of which some end before it did."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

__all__ = ["Times", "first_above", "log_rank"]

Values = NDArray[np.float64]


@dataclass(frozen=True)
class Times:
    """When it happened in each of R runs.

    Attributes:
        times: The time of the event, or of the end of the run if that came first, shape (R,).
        happened: whether it did, shape (R,).
    """

    times: Values
    happened: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.times)

    @property
    def censored(self) -> stats.CensoredData:
        """As scipy wants them."""
        return stats.CensoredData(
            uncensored=self.times[self.happened], right=self.times[~self.happened]
        )

    @property
    def median(self) -> float:
        """The time by which it has happened in half of the runs; NaN if that is not known."""
        times, shares = self.survival()
        reached = np.flatnonzero(shares <= 0.5)
        return float(times[reached[0]]) if len(reached) else float("nan")

    def survival(self) -> tuple[Values, Values]:
        """The share of runs in which it has not happened yet, by Kaplan and Meier (1958).

        Returns:
            Times at which it changes, from 0, and the share from then on; both of shape (K,).
        """
        if not self.happened.any():
            return np.array([0.0, self.times.max(initial=0.0)]), np.ones(2)
        curve = stats.ecdf(self.censored).sf
        return np.append(0.0, curve.quantiles), np.append(1.0, curve.probabilities)


def first_above(curves: Values, level: float) -> Times:
    """When runs first get above a level, counting from 1; a run that never does is censored.

    Args:
        curves: shape (R, T), NaN where there is no value.
        level: The level to be exceeded.
    """
    above: NDArray[np.bool_] = np.nan_to_num(curves, nan=-np.inf) > level
    happened: NDArray[np.bool_] = np.any(above, axis=1)
    first = np.where(happened, above.argmax(axis=1) + 1.0, float(curves.shape[1]))
    return Times(first, happened)


def log_rank(first: Times, second: Times) -> float:
    """p of the two-sided log-rank test that it happens alike in both; 1 if it never does."""
    if not (first.happened.any() or second.happened.any()):
        return 1.0
    return float(stats.logrank(first.censored, second.censored).pvalue)
