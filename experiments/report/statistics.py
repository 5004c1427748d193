"""Statistics of independent runs: test, effect size, correction for many tests, intervals.

The unit is the run: whatever was measured on a run's champion (ten terrains, say) becomes one
number before it comes here, so that n counts what is independent.

A failed episode (NaN) is worse than any speed: it counts as minus infinity in ranks, medians and
intervals. Results that would be minus infinity come out as NaN.

Few runs cannot be significant, however different they are: 3 against 3 can be ordered in 20 ways,
so that no two-sided p is below 0.1. `least_p` tells the limit, and a comparison that cannot reach
its level says "open: too few runs".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from experiments.report.intervals import ALPHA, Estimate, median, require_values, worst_first

__all__ = [
    "Comparison",
    "Pair",
    "Test",
    "compare",
    "holm",
    "least_p",
    "mann_whitney",
    "sign_p",
]

Values = NDArray[np.float64]


@dataclass(frozen=True)
class Test:
    """A two-sided Mann-Whitney U test.

    Attributes:
        p: probability of ranks at least as uneven if both samples come from one distribution.
        a12: probability that a value of the first sample is higher than one of the second, ties
            counting half (Vargha and Delaney 2000); 0.5 is no effect.
    """

    __test__ = False  # no test of pytest's

    p: float
    a12: float


@dataclass(frozen=True)
class Pair:
    """Two samples to compare, each with one value per independent run."""

    first: str
    second: str
    first_values: Values
    second_values: Values
    where: str = ""


@dataclass(frozen=True)
class Comparison:
    """What came out for one pair of a family.

    Attributes:
        where: what the pair has in common, such as "biped-4x3 low".
        n: runs of the first and of the second.
        medians: The medians of both, with 95 % bootstrap intervals.
        p: The p-value of this test alone.
        p_holm: corrected for the family.
        least_p_holm: the smallest `p_holm` that so many runs in such a family can reach.
        a12: effect size, see `Test`.
        alpha: the level of significance.
    """

    where: str
    first: str
    second: str
    n: tuple[int, int]
    medians: tuple[Estimate, Estimate]
    p: float
    p_holm: float
    least_p_holm: float
    a12: float
    alpha: float = ALPHA

    @property
    def significant(self) -> bool:
        """Whether the two differ at the level alpha, corrected for the family."""
        return self.p_holm <= self.alpha

    @property
    def decidable(self) -> bool:
        """Whether so many runs can be significant at all."""
        return self.least_p_holm <= self.alpha

    @property
    def verdict(self) -> str:
        """In words; no difference shown is not the same as none."""
        if not self.decidable:
            return "open: too few runs"
        if not self.significant:
            return "no difference shown"
        return f"{self.first if self.a12 > 0.5 else self.second} higher"


def mann_whitney(first: Values, second: Values) -> Test:
    """Two-sided Mann-Whitney U test of independent samples, as in the paper (Sec. IV).

    Exact for small samples without ties, by the normal approximation otherwise (scipy's "auto").
    With ties that approximation can fall below what the number of orderings allows (0.047 for 3
    against 3, where 0.1 is the least); `least_p` is therefore the floor.

    Args:
        first: shape (n1,), n1 >= 1.
        second: shape (n2,), n2 >= 1.

    Raises:
        ValueError: a sample is empty.
    """
    x, y = worst_first(first), worst_first(second)
    require_values(x, y)
    result = stats.mannwhitneyu(x, y, alternative="two-sided", method="auto")
    a12 = float(result.statistic) / (len(x) * len(y))  # scipy's U counts ties half
    return Test(p=max(float(result.pvalue), least_p(len(x), len(y))), a12=a12)


def least_p(n_first: int, n_second: int) -> float:
    """The smallest p that `mann_whitney` can give for samples of these sizes.

    That is when every value of the one is above every value of the other: 1.0 for 1 against 1,
    0.333 for 2, 0.1 for 3, 0.029 for 4, 0.008 for 5 against 5.
    """
    below, above = np.arange(n_first), np.arange(n_first, n_first + n_second)
    return float(stats.mannwhitneyu(below, above, alternative="two-sided", method="auto").pvalue)


def sign_p(n_on_side: int, n: int) -> float:
    """Two-sided p of the sign test, if so few of n values are on the claimed side of a bound.

    It is the test whose interval is `intervals.median_bounds`.
    """
    return min(1.0, 2 * float(stats.binom.cdf(n_on_side, n, 0.5)))


def holm(p_values: Sequence[float]) -> list[float]:
    """p-values corrected for their number by Holm's step-down method, in the order given.

    All that are at or below alpha can be called significant together, with a probability of at
    most alpha that any one is so by chance (Holm 1979).
    """
    p = np.asarray(p_values, dtype=np.float64)
    order = np.argsort(p, kind="stable")
    stepped = p[order] * np.arange(len(p), 0, -1)
    corrected = np.empty_like(p)
    corrected[order] = np.minimum(np.maximum.accumulate(stepped), 1.0)
    return [float(each) for each in corrected]


def compare(family: Sequence[Pair], *, alpha: float = ALPHA) -> list[Comparison]:
    """Test every pair of a family, and correct for their number.

    Args:
        family: the pairs that one question is answered by.
        alpha: the level of significance.

    Raises:
        ValueError: a sample is empty.
    """
    tests = [mann_whitney(pair.first_values, pair.second_values) for pair in family]
    sizes = [(len(pair.first_values), len(pair.second_values)) for pair in family]
    corrected = holm([test.p for test in tests])
    least = holm([least_p(*each) for each in sizes])
    return [
        Comparison(
            where=pair.where,
            first=pair.first,
            second=pair.second,
            n=size,
            medians=(median(pair.first_values), median(pair.second_values)),
            p=test.p,
            p_holm=p_holm,
            least_p_holm=least_p_holm,
            a12=test.a12,
            alpha=alpha,
        )
        for pair, size, test, p_holm, least_p_holm in zip(
            family, sizes, tests, corrected, least, strict=True
        )
    ]
