"""Rules by which results support or contradict a claim, or leave it open.

Version 2, fixed on 2026-11-25, before the results at the paper's full scale were in. A rule has
three outcomes; one other than open needs at least 10 runs of every condition that it is about. The
margin, stated in advance, is a difference that counts as none.

- "Higher" is supported where the Mann-Whitney test, corrected by Holm for the places of the claim,
  is significant in the claimed direction at every place and the 95 % interval of the shift (all
  shifts that the exact test does not reject) is not within the margin; contradicted where the
  corrected test is significant in the other direction at any place, or the interval of the shift,
  corrected for the number of places, is within the margin there.
- "Not worse" and "no difference" never follow from a test that failed to reject. They are
  supported where the 95 % interval of the shift is within the margin at every place; contradicted
  where a shift by the whole margin is rejected at any place, corrected by Holm. A difference that
  is significant but may be smaller than the margin contradicts nothing.
- A number is supported where its 95 % distribution-free interval over runs lies within the bounds
  at every place; contradicted where the sign test, corrected by Holm, puts the median outside at
  any. Where a run has no such number (a gait without a period), it is left out and counted, and
  half of the runs must have one.

A claim about every place is not supported while one of them was not measured. Every claim is a
family of tests of its own: of many claims that were all false, one in twenty could come out wrong.

Version 1 called a claim of "not worse" contradicted on any significant difference, decided with
fewer than 10 runs, and took a gait without a period for one of minus infinity.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from experiments.report import intervals, statistics
from experiments.report.claims.finding import Finding, Place, Side, conclude, interval, number
from experiments.report.intervals import ALPHA, Estimate
from experiments.report.statistics import Comparison, Pair

__all__ = [
    "FIXED_ON",
    "MARGIN",
    "VERSION",
    "Names",
    "Samples",
    "alike",
    "greater_gain",
    "higher",
    "not_higher",
    "not_lower",
    "within",
]

Values = NDArray[np.float64]
Names = tuple[str, str]
Samples = Mapping[str, tuple[Values, Values] | None]
"""For every place of a claim, the runs of the first and of the second; None if not measured."""

VERSION, FIXED_ON = 2, "2026-11-25"

MARGIN = 0.2
"""Differences up to this share of the second's median count as none."""

_DEFINED = 0.5  # least share of runs that have a number, where some may have none


def higher(samples: Samples, names: Names) -> Finding:
    """Judge that the first is higher than the second, everywhere."""
    places = []
    for comparison, pair in _compare(samples, names):
        margin = _margin(comparison)
        shift = intervals.shift(*pair)
        careful = intervals.shift(*pair, alpha=ALPHA / len(samples))
        says: Side = "neither"
        if _inside(careful, margin):
            says = "against"
        elif comparison.significant:
            is_higher = comparison.a12 > 0.5
            says = "against" if not is_higher else "neither" if _inside(shift, margin) else "for"
        places.append(_compared(comparison, says, comparison.a12 > 0.5, shift, margin))
    return conclude(places, samples, "a significant difference in the claimed direction")


def not_lower(samples: Samples, names: Names) -> Finding:
    """Judge that the first is not lower than the second by more than the margin, everywhere."""
    return _by_margin(samples, names, least=-1, most=np.inf)


def not_higher(samples: Samples, names: Names) -> Finding:
    """Judge that the first is not higher than the second by more than the margin, everywhere."""
    return _by_margin(samples, names, least=-np.inf, most=1)


def alike(samples: Samples, names: Names) -> Finding:
    """Judge that the two differ by no more than the margin, everywhere."""
    return _by_margin(samples, names, least=-1, most=1)


def within(
    samples: Mapping[str, Values | None],
    bounds: Mapping[str, tuple[float, float]],
    undefined: Literal["worst", "left out"] = "worst",
) -> Finding:
    """Judge that the median over runs lies within bounds, everywhere.

    Args:
        samples: one value per run for every place; None if not measured.
        bounds: For every place the least and the greatest value that the claim allows.
        undefined: what NaN is: the worst that could be, for either bound (a failed episode), or
            to be left out (a gait that has no period).
    """
    found = {where: values for where, values in samples.items() if values is not None}
    found = {where: values for where, values in found.items() if len(values)}
    defined = {
        where: values[~np.isnan(values)] if undefined == "left out" else values
        for where, values in found.items()
    }
    outside = statistics.holm([_outside(defined[where], *bounds[where]) for where in found])
    places = []
    for (where, values), p_outside in zip(found.items(), outside, strict=True):
        low, high = bounds[where]
        kept = defined[where]
        unknown = Estimate(np.nan, -np.inf, np.inf)
        estimate = intervals.median_bounds(kept) if len(kept) else unknown
        says: Side = "neither"
        if len(kept) >= _DEFINED * len(values):
            if low <= estimate.low and estimate.high <= high:
                says = "for"
            elif p_outside <= ALPHA:
                says = "against"
        without = len(values) - len(kept)
        line = (
            f"{where}: median {number(estimate.value)} of {len(kept)} runs"
            f"{f' ({without} more have none)' if without else ''}, 95 % interval "
            f"{interval(estimate)}, claimed {interval(Estimate(low, low, high))}"
        )
        leans = low <= estimate.value <= high
        places.append(Place(where, says, len(values), leans, number(estimate.value), line))
    return conclude(places, samples, "an interval within the bounds", "medians ")


def greater_gain(one: Samples, other: Samples, names: Names) -> Finding:
    """Judge that the first's gain over the second is greater in one group than in the other.

    The gain is the shift as a share of the first's median; two intervals that do not overlap
    decide, so that each has half of the level.

    Args:
        one: the group that is claimed to gain more, by place.
        other: the other group, by the same places.
        names: The names of the two groups.
    """
    both = {
        where: (pair, rest)
        for where, pair in one.items()
        if pair is not None and (rest := other[where]) is not None
    }
    places = []
    for where, pairs in both.items():
        a, b = (_gain(*pair, ALPHA / 2) for pair in pairs)
        careful_a, careful_b = (_gain(*pair, ALPHA / 2 / len(one)) for pair in pairs)
        says: Side = "neither"
        if a.low > b.high:
            says = "for"
        elif careful_a.high < careful_b.low:
            says = "against"
        gains = " and ".join(
            f"{name} {number(gain.value)} {interval(gain)}"
            for name, gain in zip(names, (a, b), strict=True)
        )
        tendency = f"{number(a.value)} against {number(b.value)}"
        n_runs = min(len(sample) for pair in pairs for sample in pair)
        line = f"{where}: gain {gains}"
        places.append(Place(where, says, n_runs, a.value > b.value, tendency, line))
    return conclude(places, one, "intervals that do not overlap", "gains ")


def _by_margin(samples: Samples, names: Names, *, least: float, most: float) -> Finding:
    """Judge that the shift is between `least` and `most` times the margin, everywhere."""
    compared = _compare(samples, names)
    beyond = [
        _beyond(compared, names, each) if np.isfinite(each) else [False] * len(compared)
        for each in (least, most)
    ]
    places = []
    for (comparison, pair), below, above in zip(compared, *beyond, strict=True):
        shift, margin = intervals.shift(*pair), _margin(comparison)
        says: Side = "neither"
        if shift.low > least * margin and shift.high < most * margin:
            says = "for"
        elif below or above:
            says = "against"
        leans = least * margin < shift.value < most * margin
        places.append(_compared(comparison, says, leans, shift, margin))
    return conclude(places, samples, "an interval within the margin")


def _beyond(
    compared: list[tuple[Comparison, tuple[Values, Values]]], names: Names, times: float
) -> list[bool]:
    """Whether each first is further from its second than a shift by `times` the margin.

    Moved back by that shift, it must still differ significantly, in the direction of the shift.
    """
    moved = [
        Pair(*names, first - times * _margin(comparison), second, comparison.where)
        for comparison, (first, second) in compared
    ]
    return [
        each.significant and (each.a12 > 0.5) == (times > 0) for each in statistics.compare(moved)
    ]


def _compare(samples: Samples, names: Names) -> list[tuple[Comparison, tuple[Values, Values]]]:
    measured = {
        where: pair
        for where, pair in samples.items()
        if pair is not None and len(pair[0]) and len(pair[1])
    }
    family = [Pair(*names, *pair, where) for where, pair in measured.items()]
    return list(zip(statistics.compare(family), measured.values(), strict=True))


def _margin(comparison: Comparison) -> float:
    return MARGIN * abs(comparison.medians[1].value)


def _inside(shift: Estimate, margin: float) -> bool:
    return -margin < shift.low and shift.high < margin


def _compared(
    comparison: Comparison, says: Side, leans: bool, shift: Estimate, margin: float
) -> Place:
    names = (comparison.first, comparison.second)
    sides = " against ".join(
        f"{name} {number(middle.value)}"
        for name, middle in zip(names, comparison.medians, strict=True)
    )
    line = (
        f"{comparison.where}: {sides} ({comparison.n[0]} and {comparison.n[1]} runs), "
        f"A12 {comparison.a12:.2f}, p {comparison.p:.2g}, Holm {comparison.p_holm:.2g}; "
        f"shift {interval(shift)}, margin {number(margin)}"
    )
    n_runs = min(comparison.n)
    return Place(comparison.where, says, n_runs, leans, f"{comparison.a12:.2f}", line)


def _outside(values: Values, low: float, high: float) -> float:
    """p of the sign test against the nearest bound, if the median is outside the bounds.

    Undefined values count as if they were inside, so that they contradict nothing.
    """
    not_below = int((np.nan_to_num(values, nan=np.inf) >= low).sum())
    not_above = int((np.nan_to_num(values, nan=-np.inf) <= high).sum())
    return min(statistics.sign_p(n, len(values)) for n in (not_below, not_above))


def _gain(first: Values, second: Values, alpha: float) -> Estimate:
    """The shift as a share of the first's median; unbounded if that is not positive."""
    shift, scale = intervals.shift(first, second, alpha=alpha), intervals.middle(first)
    if not scale > 0:
        return Estimate(float("nan"), -np.inf, np.inf)
    return Estimate(shift.value / scale, shift.low / scale, shift.high / scale)
