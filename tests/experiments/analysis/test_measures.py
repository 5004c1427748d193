"""Measures of weights, activations and gaits, against numbers worked out by hand."""

import numpy as np
import pytest
from scipy import stats

from experiments.analysis.measures import (
    activation_measures,
    command_measures,
    gait_measures,
    term_shares,
    weight_measures,
)
from experiments.analysis.spectrum import frequency_of, period_of, power_above, regularity_of

TIMES = np.arange(480) / 60


def test_weights_by_hand() -> None:
    measures = weight_measures(np.array([1.0, -1.0, 2.0, -2.0, 2.0, -21.0, 20.0, 1.0], np.float32))
    assert measures["median"] == 2.0
    assert measures["largest"] == 21.0
    assert measures["diverged"] == 1 / 8  # 21; 20 is not beyond ten medians


def test_kurtosis_tells_extremes_from_a_bell_and_from_a_box() -> None:
    rng = np.random.default_rng(1)
    bell, box = rng.normal(size=20_000), rng.uniform(-1, 1, 20_000)
    extremes = np.concatenate((bell, [30.0, -30.0]))
    for values, expected in ((bell, 0.0), (box, -1.2)):
        assert weight_measures(values)["kurtosis"] == pytest.approx(expected, abs=0.1)
    kurtosis = weight_measures(extremes)["kurtosis"]
    assert kurtosis == pytest.approx(stats.kurtosis(extremes))
    assert kurtosis > 10


def test_weights_that_are_all_alike_have_no_distribution() -> None:
    assert weight_measures(np.zeros(4)) == {
        "median": 0.0,
        "largest": 0.0,
        "diverged": None,
        "kurtosis": None,
    }


def test_activations_by_hand() -> None:
    up, down = [0.95] * 20 + [-0.95] * 20, [-1.0] * 40
    soft = [0.05, 0.5] * 20
    measures = activation_measures(np.array([up, down, soft]).T)
    assert measures["high"] == pytest.approx(20 / 120)
    assert measures["low"] == pytest.approx(60 / 120)
    assert measures["saturated"] == pytest.approx(80 / 120)
    assert measures["middle"] == pytest.approx(20 / 120)
    assert measures["switching"] == pytest.approx(1 / 3)  # only the first one
    assert measures["changes"] == pytest.approx(60 * 1 / (3 * 39))  # one, of the first neuron


def test_period_of_a_gait_with_overtones() -> None:
    phases = np.array([0.0, 1.0, 4.0])
    turns = 2 * np.pi * TIMES[:, None] / 1.5 + phases
    levels = 0.3 + np.sin(turns) + 0.6 * np.sin(2 * turns + 1)
    assert period_of(levels) == pytest.approx(1.5, abs=0.02)


@pytest.mark.parametrize("seconds", [0.05, 0.11, 0.125, 0.5, 1.0, 2.0])
def test_period_of_a_sine(seconds: float) -> None:
    wave = np.sin(2 * np.pi * TIMES[:, None] / seconds).astype(np.float16)
    assert period_of(wave) == pytest.approx(seconds, rel=0.01)
    assert frequency_of(wave, step=0.1) == pytest.approx(1 / seconds / 6, rel=0.01)
    assert regularity_of(wave) > (0.9 if seconds > 0.1 else 0.8)


def test_the_stronger_of_two_movements_is_the_gait() -> None:
    slow, fast = (np.sin(2 * np.pi * hertz * TIMES[:, None]) for hertz in (0.5, 8.6))
    assert frequency_of(2 * slow + fast) == pytest.approx(0.5, rel=0.02)
    assert frequency_of(slow + 2 * fast) == pytest.approx(8.6, rel=0.01)


def test_power_above_a_frequency() -> None:
    slow, fast = (np.sin(2 * np.pi * hertz * TIMES[:, None]) for hertz in (1.0, 9.0))
    assert power_above(2 * slow + fast, 4.0) == pytest.approx(0.2, abs=1e-3)  # 1 of 4 + 1
    assert power_above(fast, 4.0) == pytest.approx(1.0, abs=1e-6)
    assert power_above(slow, 4.0) == pytest.approx(0.0, abs=1e-6)
    assert power_above(np.ones((480, 2)), 4.0) is None
    assert power_above(slow, 4.0, step=0.2) is None  # cannot be seen every 0.2 s


def test_measures_of_a_gait() -> None:
    wave = 1 + 0.1 * np.sin(2 * np.pi * 8.0 * TIMES[:, None] + np.array([0.0, 1.0]))
    found = gait_measures(wave.astype(np.float16))
    assert found["gait_frequency"] == pytest.approx(8.0, rel=0.01)
    assert found["gait_period"] == pytest.approx(1 / 8, rel=0.01)
    assert found["vibration"] == pytest.approx(1.0, abs=0.01)


def test_measures_of_commands() -> None:
    """Two postures in turns for eight steps, then two others, the last one in part."""
    postures = np.array([[1.0, -1.0], [-1.0, 1.0]] * 4 + [[1.0, 1.0], [-1.0, -0.5]])
    found = command_measures(postures)
    assert found == {"saturated": 0.95, "alternating": 0.8}


def test_what_does_not_repeat_itself_has_no_period() -> None:
    noise = np.random.default_rng(0).normal(size=(480, 4))
    assert period_of(noise) is None
    assert 0 < regularity_of(noise) < 0.2
    for other in (np.ones((480, 4)), np.exp(-TIMES)[:, None], np.sin(TIMES[:3])[:, None]):
        assert period_of(other) is None
        assert regularity_of(other) is None
    assert period_of(np.full((480, 2), np.nan)) is None


def test_shares_of_terms() -> None:
    shares = term_shares(np.array([1.0, 2.0, 4.0, 1.0]))
    assert shares == {"A": 0.125, "B": 0.25, "C": 0.5, "D": 0.125}
    assert set(term_shares(np.zeros(4)).values()) == {None}
