"""Statistics against values from textbooks, by hand and by counting."""

import itertools
import math

import numpy as np
import pytest
from scipy import stats

from experiments.report import intervals
from experiments.report.statistics import Pair, compare, holm, least_p, mann_whitney

NAN = math.nan


def array(*values: float) -> np.ndarray:
    return np.array(values, dtype=np.float64)


def exact_p(first: np.ndarray, second: np.ndarray) -> float:
    """Two-sided p by going through every way to split the values, all different."""
    values = np.concatenate([first, second])

    def u(chosen: tuple[int, ...]) -> int:
        rest = np.delete(values, chosen)
        return sum(int((values[i] > rest).sum()) for i in chosen)

    ways = [u(each) for each in itertools.combinations(range(len(values)), len(first))]
    seen = u(tuple(range(len(first))))
    below = np.mean([each <= seen for each in ways])
    above = np.mean([each >= seen for each in ways])
    return float(min(1.0, 2 * min(below, above)))


@pytest.mark.parametrize(
    ("first", "second", "a12"),
    [
        (array(1, 2, 3), array(4, 5, 6), 0.0),
        (array(4, 5, 6), array(1, 2, 3), 1.0),
        (array(1, 4), array(2, 3), 0.5),
        (array(1, 2), array(2, 3), 0.125),  # one tie, which counts half: 0.5 of 4 pairs
        (array(5, 5), array(5, 5), 0.5),
    ],
)
def test_effect_size(first: np.ndarray, second: np.ndarray, a12: float) -> None:
    assert mann_whitney(first, second).a12 == a12


@pytest.mark.parametrize(("n1", "n2"), [(3, 3), (4, 6), (5, 5)])
def test_p_of_small_samples_is_exact(n1: int, n2: int) -> None:
    rng = np.random.default_rng(n1)
    first, second = rng.normal(0.8, 1, n1), rng.normal(0, 1, n2)
    assert mann_whitney(first, second).p == pytest.approx(exact_p(first, second))


def test_p_of_larger_samples_is_scipys() -> None:
    rng = np.random.default_rng(1)
    first, second = rng.normal(1, 1, 10), rng.normal(0, 1, 10)
    expected = stats.mannwhitneyu(first, second, alternative="two-sided").pvalue
    assert mann_whitney(first, second).p == expected


def test_a_failed_life_is_worse_than_any_speed() -> None:
    with_failure = mann_whitney(array(NAN, 5, 6), array(-100, 1, 2))
    assert with_failure == mann_whitney(array(-1000, 5, 6), array(-100, 1, 2))
    assert intervals.middle(array(NAN, 1, 2)) == 1
    assert math.isnan(intervals.middle(array(NAN, NAN, 2)))


def test_the_least_p() -> None:
    # 2 / (ways to choose n1 of n1 + n2), the two most uneven orderings.
    for n1, n2 in ((1, 1), (3, 3), (3, 4), (5, 5), (4, 8)):
        assert least_p(n1, n2) == pytest.approx(min(1, 2 / math.comb(n1 + n2, n1)))
    assert least_p(3, 3) == pytest.approx(0.1)
    assert least_p(4, 4) < 0.05 < least_p(3, 3)


def test_ties_do_not_bring_p_below_what_is_possible() -> None:
    ones, twos = array(1, 1, 1), array(2, 2, 2)
    assert stats.mannwhitneyu(ones, twos).pvalue < 0.05  # the normal approximation's
    assert mann_whitney(ones, twos).p == pytest.approx(0.1)


def test_holm() -> None:
    # Sorted .01 .02 .03 .04 times 4 3 2 1: .04 .06 .06 .04, made monotonous.
    assert holm([0.04, 0.01, 0.03, 0.02]) == pytest.approx([0.06, 0.04, 0.06, 0.06])
    assert holm([0.6, 0.7]) == [1.0, 1.0]
    assert holm([]) == []


def test_the_median_has_a_bootstrap_interval_that_follows_its_seed() -> None:
    values = np.random.default_rng(0).normal(3, 1, 400)
    estimate = intervals.median(values)
    assert estimate == intervals.median(values)
    assert estimate.value == np.median(values)
    assert estimate.low < estimate.value < estimate.high
    with intervals.resampling_with(1):
        assert intervals.median(values) != estimate
    assert intervals.median(values) == estimate


def test_the_bootstrap_interval_holds_the_true_median_about_as_often_as_it_says() -> None:
    rng = np.random.default_rng(2)
    held = []
    for _ in range(100):
        estimate = intervals.median(rng.normal(0, 1, 15))
        held.append(estimate.low <= 0 <= estimate.high)
    assert 0.88 <= np.mean(held) <= 1.0


def test_the_bootstrap_interval_of_equal_values_is_a_point() -> None:
    assert intervals.median(array(2, 2, 2)) == intervals.Estimate(2, 2, 2)
    assert intervals.median(array(7)) == intervals.Estimate(7, 7, 7)


def test_a_bound_that_falls_on_failed_lives_is_nan() -> None:
    estimate = intervals.median(array(NAN, NAN, 1, 2, 3))
    assert estimate.value == 1
    assert math.isnan(estimate.low)
    assert estimate.high == 3


def test_quartiles_are_ordered_and_take_failed_lives_for_the_worst() -> None:
    values = np.array([5.0, 1.0, 4.0, 2.0, 3.0, 6.0, 7.0])
    low, high = intervals.quartiles(values)
    # Hyndman and Fan (1996), definition 8: place (n + 1/3) p + 1/3 of the ordered values.
    assert low == pytest.approx((7 + 1 / 3) / 4 + 1 / 3)
    assert high == pytest.approx((7 + 1 / 3) * 3 / 4 + 1 / 3)
    failed = np.array([np.nan, np.nan, np.nan, 1.0, 2.0, 3.0, 4.0])
    low, high = intervals.quartiles(failed)
    assert np.isnan(low)
    assert 2.0 < high < 4.0


def test_distribution_free_bounds_of_the_median() -> None:
    # P(all above or all below the median) = 2 / 2^n: 0.0625 for 5, 0.03125 for 6.
    five = intervals.median_bounds(array(1, 2, 3, 4, 5))
    assert (five.low, five.value, five.high) == (-math.inf, 3, math.inf)
    six = intervals.median_bounds(array(6, 1, 2, 3, 4, 5))
    assert (six.low, six.value, six.high) == (1, 3.5, 6)
    # Of ten, the second and the ninth: 2 (1 + 10) / 2^10 = 0.021.
    ten = intervals.median_bounds(np.arange(1.0, 11))
    assert (ten.low, ten.high) == (2, 9)
    failed = intervals.median_bounds(array(NAN, 1, 2, 3, 4, 5))
    assert (failed.low, failed.high) == (-math.inf, math.inf)


def test_the_shift_holds_what_the_exact_test_does_not_reject() -> None:
    rng = np.random.default_rng(3)
    first, second = rng.normal(2, 1, 5), rng.normal(0, 1, 6)
    estimate = intervals.shift(first, second)
    differences = np.subtract.outer(first, second).ravel()
    assert estimate.value == np.median(differences)
    middles = (np.sort(differences)[1:] + np.sort(differences)[:-1]) / 2
    for shift in middles:
        kept = exact_p(first - shift, second) > 0.05
        assert kept == (estimate.low < shift < estimate.high)


def test_the_shift_of_too_few_runs_is_unbounded() -> None:
    three = intervals.shift(array(10, 11, 12), array(1, 2, 3))
    assert (three.low, three.value, three.high) == (-math.inf, 9, math.inf)
    four = intervals.shift(array(10, 11, 12, 13), array(1, 2, 3, 4))
    assert (four.low, four.high) == (6, 12)


def test_a_comparison_of_too_few_runs_stays_open() -> None:
    (found,) = compare([Pair("A", "B", array(10, 11, 12), array(1, 2, 3), "here")])
    assert (found.a12, found.p) == (1.0, pytest.approx(0.1))
    assert found.verdict == "open: too few runs"


def test_verdicts_are_corrected_for_the_family() -> None:
    low, high = np.arange(5.0), np.arange(10.0, 15.0)
    alike = np.arange(5.0) + 0.5
    pair = Pair("A", "B", high, low)
    (alone,) = compare([pair])
    assert alone.p == pytest.approx(2 / 252)
    assert alone.verdict == "A higher"
    assert compare([Pair("A", "B", low, high)])[0].verdict == "B higher"
    family = compare([pair, Pair("A", "B", low, alike)])
    assert family[0].p_holm == pytest.approx(4 / 252)
    assert [each.verdict for each in family] == ["A higher", "no difference shown"]
    # Seven such pairs can be significant no more if 2 / 252 is the least p of each.
    assert {each.verdict for each in compare([pair] * 7)} == {"open: too few runs"}


def test_an_empty_sample_is_refused() -> None:
    for call in (intervals.median, intervals.median_bounds):
        with pytest.raises(ValueError, match="values: expected at least one"):
            call(array())
    with pytest.raises(ValueError, match="values: expected at least one"):
        mann_whitney(array(), array(1))
