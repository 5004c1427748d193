"""Several conditions together, and first times with censoring, against numbers by hand."""

import math

import numpy as np
import pytest

from experiments.report import aggregates, survival
from experiments.report.intervals import resampling_with

NAN = math.nan


def array(*values: float) -> np.ndarray:
    return np.array(values, dtype=float)


def test_interquartile_mean_of_all_runs() -> None:
    # Of 1..8 the middle half is 3, 4, 5, 6.
    found = aggregates.interquartile_mean([array(1, 8, 3, 100), array(2, 4, 6, 5)])
    assert found.value == pytest.approx(4.5)
    assert found.low < found.value < found.high
    failed = aggregates.interquartile_mean([array(NAN, 8, 3, 7), array(2, 4, 6, 5)])
    assert failed.value == pytest.approx((3 + 4 + 5 + 6) / 4)  # NaN counts as 3, its slowest


def test_runs_are_drawn_within_their_condition() -> None:
    # Each condition is constant: whatever is drawn, nothing changes.
    found = aggregates.interquartile_mean([array(1, 1, 1, 1), array(9, 9, 9, 9)])
    assert (found.low, found.value, found.high) == (5.0, 5.0, 5.0)


def test_mean_probability_of_improvement() -> None:
    found = aggregates.mean_a12([(array(1, 4), array(2, 3)), (array(5, 6), array(5, NAN))])
    assert found.value == pytest.approx((0.5 + (0.5 + 1 + 1 + 1) / 4) / 2)
    both_failed = aggregates.mean_a12([(array(NAN), array(NAN))])
    assert both_failed.value == 0.5


def test_profile_counts_the_faster_runs() -> None:
    share, low, high = aggregates.profile([array(1, 2, NAN), array(3)], array(0.0, 1.0, 2.5))
    assert share.tolist() == [0.75, 0.5, 0.25]
    assert (low <= share).all()
    assert (share <= high).all()


def test_intervals_follow_the_seed_of_resampling() -> None:
    samples = [np.random.default_rng(0).normal(size=10)]
    first = aggregates.interquartile_mean(samples)
    assert first == aggregates.interquartile_mean(samples)
    with resampling_with(1):
        assert first != aggregates.interquartile_mean(samples)


def test_an_empty_sample_is_refused() -> None:
    with pytest.raises(ValueError, match="values: expected at least one"):
        aggregates.interquartile_mean([array(1), array()])


CURVES = np.array([[0.1, 2.0, 0.5, 3.0], [NAN, 0.9, 1.0, 1.1], [0.0, 0.0, NAN, 0.9]])


def test_first_times_and_runs_that_never_get_there() -> None:
    times = survival.first_above(CURVES, 1.0)
    assert times.times.tolist() == [2, 4, 4]
    assert times.happened.tolist() == [True, True, False]


def test_survival_by_hand() -> None:
    # Kaplan and Meier: at 2 one of three, at 4 one of the two left (the third is censored there).
    when, share = survival.first_above(CURVES, 1.0).survival()
    assert when.tolist() == [0, 2, 4]
    assert share == pytest.approx([1, 2 / 3, 1 / 3])
    assert survival.first_above(CURVES, 1.0).median == 4
    never = survival.first_above(CURVES, 10.0)
    assert never.survival()[1].tolist() == [1, 1]
    assert math.isnan(never.median)


def test_log_rank_by_hand() -> None:
    first = survival.Times(array(1, 2, 3), np.array([True, True, False]))
    second = survival.Times(array(2, 3, 3), np.array([True, True, True]))
    # Expected deaths of the first: 1 * 3/6 at 1, 2 * 2/5 at 2, 2 * 1/3 at 3; variances likewise.
    observed, expected = 2, 3 / 6 + 2 * 2 / 5 + 2 * 1 / 3
    variance = 3 * 3 / 6**2 + 2 * 2 * 3 * 3 / (5**2 * 4) + 2 * 1 * 2 * 1 / (3**2 * 2)
    z = (observed - expected) / math.sqrt(variance)
    assert survival.log_rank(first, second) == pytest.approx(math.erfc(abs(z) / math.sqrt(2)))
    never = survival.Times(array(3, 3), np.array([False, False]))
    assert survival.log_rank(never, never) == 1.0
