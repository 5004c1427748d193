"""Rules by which results support or contradict a claim, or leave it open.

They are conservative: a verdict other than open needs a test at the 5 % level, or an interval on
one side of a bound that was stated in advance.

- A difference is supported where the Mann-Whitney test, corrected by Holm for the places of the
  claim, is significant in the claimed direction at every place; contradicted where it is
  significant in the other direction at any.
- "Not worse" and "no difference" never follow from a test that failed to reject. They are
  supported where the 95 % interval of the shift (all shifts that the exact test does not reject)
  stays within the margin at every place; contradicted where the corrected test is significant at
  any place whose interval does not.
- A number is supported where its 95 % distribution-free interval over runs lies within the bounds
  at every place; contradicted where its interval, corrected for the number of places, lies outside
  at any.

A claim about every place is not supported while one of them was not measured. Every claim is a
family of tests of its own: of many claims that were all false, one in twenty could come out wrong.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from experiments.report import intervals, statistics
from experiments.report.intervals import ALPHA, Estimate
from experiments.report.statistics import Comparison, Pair

__all__ = [
    "MARGIN",
    "Finding",
    "Names",
    "Samples",
    "Verdict",
    "alike",
    "greater_gain",
    "higher",
    "not_higher",
    "not_lower",
    "within",
]

Values = NDArray[np.float64]
Verdict = Literal["supported", "contradicted", "open at this scale"]
Side = Literal["for", "against", "neither"]
Names = tuple[str, str]
Samples = Mapping[str, tuple[Values, Values] | None]
"""For every place of a claim, the runs of the first and of the second; None if not measured."""

MARGIN = 0.2
"""Differences up to this share of the second's median count as none."""


@dataclass(frozen=True)
class Finding:
    """What came out.

    Attributes:
        verdict: on the claim.
        reason: for the verdict.
        tendency: what the runs point to, place by place, whatever the verdict.
        measured: a line for each place.
    """

    verdict: Verdict
    reason: str
    tendency: str
    measured: tuple[str, ...]


@dataclass(frozen=True)
class _Place:
    """What came out at one place."""

    where: str
    says: Side
    decidable: bool
    leans: bool  # to the claim, whether or not that is significant
    tendency: str
    measured: str


def higher(samples: Samples, names: Names) -> Finding:
    """Judge that the first is higher than the second, everywhere."""
    places = []
    for comparison in _compare(samples, names):
        says: Side = "neither"
        if comparison.significant:
            says = "for" if comparison.a12 > 0.5 else "against"
        leans = comparison.a12 > 0.5
        places.append(_compared(comparison, says, comparison.decidable, leans))
    return _conclude(places, samples, "a significant difference in the claimed direction")


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
    samples: Mapping[str, Values | None], bounds: Mapping[str, tuple[float, float]]
) -> Finding:
    """Judge that the median over runs lies within bounds, everywhere.

    Args:
        samples: one value per run for every place; None if not measured.
        bounds: for every place, least and most.
    """
    places = []
    for where, values in samples.items():
        if values is None or not len(values):
            continue
        low, high = bounds[where]
        estimate = intervals.median_bounds(values)
        careful = intervals.median_bounds(values, alpha=ALPHA / len(samples))
        says: Side = "neither"
        if low <= estimate.low and estimate.high <= high:
            says = "for"
        elif careful.high < low or careful.low > high:
            says = "against"
        line = (
            f"{where}: median {_number(estimate.value)} of {len(values)} runs, 95 % interval "
            f"{_interval(estimate)}, claimed {_interval(Estimate(low, low, high))}"
        )
        decidable = bool(np.isfinite([estimate.low, estimate.high]).any())
        leans = low <= estimate.value <= high
        places.append(_Place(where, says, decidable, leans, _number(estimate.value), line))
    return _conclude(places, samples, "an interval within the bounds", "medians ")


def greater_gain(one: Samples, other: Samples, names: Names) -> Finding:
    """Judge that the first's gain over the second is greater in one group than in the other.

    The gain is the shift as a share of the first's median; two intervals that do not overlap
    decide, so that each has half of the level.

    Args:
        one: the group that is claimed to gain more, by place.
        other: the other group, by the same places.
        names: of the two groups.
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
            f"{name} {_number(gain.value)} {_interval(gain)}"
            for name, gain in zip(names, (a, b), strict=True)
        )
        tendency = f"{_number(a.value)} against {_number(b.value)}"
        decidable = bool(np.isfinite([a.low, b.low]).all())
        leans = a.value > b.value
        places.append(_Place(where, says, decidable, leans, tendency, f"{where}: gain {gains}"))
    return _conclude(places, one, "intervals that do not overlap", "gains ")


def _by_margin(samples: Samples, names: Names, *, least: float, most: float) -> Finding:
    """Judge that the shift is between `least` and `most` times the margin, everywhere."""
    places = []
    for comparison in _compare(samples, names):
        pair = samples[comparison.where]
        assert pair is not None
        shift = intervals.shift(*pair)
        margin = MARGIN * abs(comparison.medians[1].value)
        says: Side = "neither"
        if shift.low > least * margin and shift.high < most * margin:
            says = "for"
        elif comparison.significant and np.isfinite(least if comparison.a12 < 0.5 else most):
            says = "against"
        decidable = comparison.decidable or bool(np.isfinite([shift.low, shift.high]).any())
        more = f"; shift {_interval(shift)}, margin {_number(margin)}"
        leans = least * margin < shift.value < most * margin
        places.append(_compared(comparison, says, decidable, leans, more))
    return _conclude(places, samples, "an interval within the margin")


def _compare(samples: Samples, names: Names) -> list[Comparison]:
    return statistics.compare(
        [
            Pair(*names, *pair, where)
            for where, pair in samples.items()
            if pair is not None and len(pair[0]) and len(pair[1])
        ]
    )


def _compared(
    comparison: Comparison, says: Side, decidable: bool, leans: bool, more: str = ""
) -> _Place:
    names = (comparison.first, comparison.second)
    sides = " against ".join(
        f"{name} {_number(middle.value)}"
        for name, middle in zip(names, comparison.medians, strict=True)
    )
    line = (
        f"{comparison.where}: {sides} ({comparison.n[0]} and {comparison.n[1]} runs), "
        f"A12 {comparison.a12:.2f}, p {comparison.p:.2g}, Holm {comparison.p_holm:.2g}{more}"
    )
    return _Place(comparison.where, says, decidable, leans, f"{comparison.a12:.2f}", line)


def _conclude(
    places: Sequence[_Place], samples: Mapping[str, object], needed: str, kind: str = "A12 "
) -> Finding:
    measured = tuple(place.measured for place in places)
    tendency = ""
    if places:
        values = ", ".join(place.tendency for place in places)
        leaning = sum(place.leans for place in places)
        tendency = f"as claimed at {leaning} of {len(places)} place(s): {kind}{values}"
    against = [place.where for place in places if place.says == "against"]
    if against:
        reason = f"significantly otherwise: {_list(against, samples)}"
        return Finding("contradicted", reason, tendency, measured)
    missing = [where for where in samples if where not in {place.where for place in places}]
    neither = [place for place in places if place.says == "neither"]
    if places and not missing and not neither:
        return Finding("supported", f"{needed} at every place", tendency, measured)
    reasons = {
        "not measured": missing,
        "too few runs, whatever they show": [p.where for p in neither if not p.decidable],
        f"without {needed}": [p.where for p in neither if p.decidable],
    }
    reason = "; ".join(f"{why}: {_list(each, samples)}" for why, each in reasons.items() if each)
    return Finding("open at this scale", reason, tendency, measured)


def _list(places: Sequence[str], samples: Mapping[str, object]) -> str:
    return "everywhere" if len(places) == len(samples) else ", ".join(places)


def _gain(first: Values, second: Values, alpha: float) -> Estimate:
    """The shift as a share of the first's median; unbounded if that is not positive."""
    shift, scale = intervals.shift(first, second, alpha=alpha), intervals.middle(first)
    if not scale > 0:
        return Estimate(float("nan"), -np.inf, np.inf)
    return Estimate(shift.value / scale, shift.low / scale, shift.high / scale)


def _interval(estimate: Estimate) -> str:
    return f"[{_number(estimate.low)}, {_number(estimate.high)}]"


def _number(value: float) -> str:
    return "n/a" if np.isnan(value) else f"{value:.3g}".replace("inf", "∞")
