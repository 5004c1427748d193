"""Rules of the verdicts: only what is significant, or within bounds, is ever decided."""

import math

import numpy as np
import pytest

from experiments.report import intervals
from experiments.report.claims import verdicts
from experiments.report.claims.finding import Finding

NAN = math.nan
NAMES = ("A", "B")
LOW = np.linspace(1.0, 1.1, 10)
HIGH = LOW + 1


def verdict_of(finding: Finding) -> str:
    return finding.verdict.split()[0]


@pytest.mark.parametrize(
    ("first", "second", "higher", "not_lower", "not_higher", "alike"),
    [
        (HIGH, LOW, "supported", "supported", "contradicted", "contradicted"),
        (LOW, HIGH, "contradicted", "contradicted", "supported", "contradicted"),
        # No difference: no test rejects, but the intervals lie within the margin.
        (LOW, LOW, "contradicted", "supported", "supported", "supported"),
        # A significant difference of 0.15, less than the margin of 20 % of 1.05, is none.
        (LOW + 0.15, LOW, "contradicted", "supported", "supported", "supported"),
        # A significant one that may be smaller or greater than the margin decides half of it.
        (LOW + 0.2, LOW, "supported", "supported", "open", "open"),
        (LOW - 0.2, LOW, "contradicted", "open", "supported", "open"),
        # Fewer than ten: nothing is decided, though nine would be significant.
        (HIGH[:3], LOW[:3], "open", "open", "open", "open"),
        (HIGH[:9], LOW, "open", "open", "open", "open"),
        # As different as can be, but as scattered.
        (10 * LOW, np.geomspace(0.1, 1000, 10), "open", "open", "open", "open"),
    ],
)
def test_rules_for_two_samples(
    first: np.ndarray, second: np.ndarray, higher: str, not_lower: str, not_higher: str, alike: str
) -> None:
    samples = {"here": (first, second)}
    for rule, expected in (
        (verdicts.higher, higher),
        (verdicts.not_lower, not_lower),
        (verdicts.not_higher, not_higher),
        (verdicts.alike, alike),
    ):
        assert verdict_of(rule(samples, NAMES)) == expected, rule.__name__


def test_a_claim_holds_everywhere_or_not_at_all() -> None:
    good, bad = (HIGH, LOW), (LOW, HIGH)
    assert verdict_of(verdicts.higher({"a": good, "b": good}, NAMES)) == "supported"
    scattered = (10 * LOW, np.geomspace(0.1, 1000, 10))
    unclear = verdicts.higher({"a": good, "b": scattered}, NAMES)
    assert verdict_of(unclear) == "open"
    assert unclear.reason == "without a significant difference in the claimed direction: b"
    missing = verdicts.higher({"a": good, "b": None}, NAMES)
    assert (verdict_of(missing), missing.reason) == ("open", "not measured: b")
    against = verdicts.higher({"a": good, "b": bad, "c": None}, NAMES)
    assert (verdict_of(against), against.reason) == ("contradicted", "significantly otherwise: b")
    nothing = verdicts.higher({"a": None}, NAMES)
    assert (verdict_of(nothing), nothing.tendency) == ("open", "")


def test_too_few_runs_still_tell_the_direction() -> None:
    finding = verdicts.higher({"here": (HIGH[:3], LOW[:3])}, NAMES)
    assert finding.reason == "fewer than 10 runs: everywhere"
    assert finding.tendency == "as claimed at 1 of 1 place(s): A12 1.00"
    assert "p 0.1" in finding.measured[0]


@pytest.mark.parametrize(
    ("values", "bounds", "expected"),
    [
        (LOW, (0.9, 1.2), "supported"),
        (LOW, (0.0, 0.9), "contradicted"),
        (LOW, (1.05, 2.0), "open"),
        (LOW[:9], (0.0, 2.0), "open"),  # fewer than ten
        (np.append(LOW, [NAN] * 5), (0.0, 2.0), "open"),
        (np.full(10, NAN), (-math.inf, 0.0), "open"),  # undefined is no small number
    ],
)
def test_rule_for_numbers(values: np.ndarray, bounds: tuple[float, float], expected: str) -> None:
    assert verdict_of(verdicts.within({"here": values}, {"here": bounds})) == expected


@pytest.mark.parametrize(
    ("values", "bounds", "expected"),
    [
        (np.append(LOW[:6], [NAN] * 4), (0.9, 1.2), "supported"),
        (np.append(LOW[:6], [NAN] * 4), (1.2, 2.0), "contradicted"),
        (np.append(LOW[:6], [NAN] * 7), (0.9, 1.2), "open"),  # half of the runs have no number
        (np.full(10, NAN), (0.9, 1.2), "open"),
    ],
)
def test_runs_without_a_number_are_left_out_and_counted(
    values: np.ndarray, bounds: tuple[float, float], expected: str
) -> None:
    finding = verdicts.within({"here": values}, {"here": bounds}, undefined="left out")
    assert verdict_of(finding) == expected
    assert f"({np.isnan(values).sum()} more have none)" in finding.measured[0]


def test_places_of_a_claim_are_corrected_by_holm() -> None:
    # Outside at one place with p 0.021 (nine of ten): one of three such is no longer significant.
    values = np.append(LOW[:9], 5.0)
    bounds = (2.0, 6.0)
    assert verdict_of(verdicts.within({"a": values}, {"a": bounds})) == "contradicted"
    samples = {"a": values, "b": LOW, "c": LOW}
    inside = (0.9, 1.2)
    three = verdicts.within(samples, {"a": bounds, "b": inside, "c": inside})
    assert verdict_of(three) == "open"


def test_rule_for_gains() -> None:
    much, little = {"here": (HIGH, LOW)}, {"here": (LOW + 0.1, LOW)}
    names = ("biped", "worm")
    assert verdict_of(verdicts.greater_gain(much, little, names)) == "supported"
    assert verdict_of(verdicts.greater_gain(little, much, names)) == "contradicted"
    assert verdict_of(verdicts.greater_gain(much, much, names)) == "open"
    # Gains are shares: 1 of 2.05 and 0.1 of 1.15.
    assert verdicts.greater_gain(much, little, names).tendency.endswith("gains 0.488 against 0.087")


def gains_that_differ(by: float) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
    """Runs of a group with gains around `by` times 1e-3, and of one with gains around 0."""
    second = 1000 + np.arange(12.0) ** 1.3
    first = 1000 + np.arange(12.0) ** 1.2
    return (first + by, second), (first, second)


def smallest_difference(alpha: float) -> float:
    """How far the gains of both groups must be apart for their intervals not to overlap."""
    differences = np.linspace(0, 30, 3001)
    for by in differences:
        (one, second), (other, _) = gains_that_differ(float(by))
        a, b = (intervals.shift(first, second, alpha=alpha) for first in (one, other))
        if a.low / np.median(one) > b.high / np.median(other):
            return float(by)
    raise AssertionError


def test_two_intervals_have_half_of_the_level_each() -> None:
    """A difference that intervals at the whole level would show is not enough."""
    whole, half = smallest_difference(0.05), smallest_difference(0.025)
    assert whole < half - 0.02
    much, little = gains_that_differ((whole + half) / 2)
    assert verdict_of(verdicts.greater_gain({"a": much}, {"a": little}, ("one", "other"))) == "open"
    much, little = gains_that_differ(half + 0.1)
    finding = verdicts.greater_gain({"a": much}, {"a": little}, ("one", "other"))
    assert verdict_of(finding) == "supported"


def test_a_gain_is_contradicted_at_the_level_of_all_places_together() -> None:
    one_place, two_places = smallest_difference(0.025), smallest_difference(0.0125)
    assert one_place < two_places - 0.02
    much, little = gains_that_differ((one_place + two_places) / 2)
    alone = verdicts.greater_gain({"a": little}, {"a": much}, ("one", "other"))
    assert verdict_of(alone) == "contradicted"
    both = verdicts.greater_gain(
        {"a": little, "b": little}, {"a": much, "b": much}, ("one", "other")
    )
    assert verdict_of(both) == "open"
