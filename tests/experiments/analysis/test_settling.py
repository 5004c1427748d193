"""Whether weights come to rest: made-up courses, and champions that do not learn."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.analysis.settling import describe, observe
from physics import DT
from tests.experiments.champions import PLASTIC, random_champions

TIMES = DT * np.arange(1, 1201)[:, None]
SIZES = np.random.default_rng(0).uniform(0.5, 1.5, 30)
PHASES = np.random.default_rng(1).uniform(0, 2 * np.pi, 30)


@pytest.mark.parametrize(
    ("course", "weights"),
    [
        ("fixed point", SIZES + 0.001 * np.sin(9 * TIMES)),
        ("limit cycle", SIZES * (1 + 0.1 * np.sin(2 * np.pi * TIMES / 1.6 + PHASES))),
        ("drift", SIZES * TIMES * (1 + 0.01 * np.sin(9 * TIMES))),
        ("irregular", SIZES + np.random.default_rng(2).normal(0, 0.2, (len(TIMES), 30))),
    ],
)
def test_courses_are_told_apart(course: str, weights: np.ndarray) -> None:
    assert describe(weights, DT).course == course


def test_measures_of_a_cycle() -> None:
    found = describe(SIZES * (1 + 0.1 * np.sin(2 * np.pi * TIMES / 1.6 + PHASES)), DT)
    assert found.period == pytest.approx(1.6, abs=0.01)
    assert found.variation == pytest.approx(0.1 / np.sqrt(2), rel=0.02)
    # |sin(a + d) - sin(a)| is 2 |sin(d / 2)| |cos| on average, of which |cos| has the mean 2 / pi.
    mean_change = 0.1 * 2 * abs(np.sin(np.pi / 1.6)) * 2 / np.pi
    assert found.change == pytest.approx(mean_change, rel=0.05)


def test_who_does_not_learn_is_at_rest_and_as_fast_when_frozen() -> None:
    config = replace(PLASTIC, eta=0.0, init="uniform")
    for found in observe(config, random_champions(config).genomes):
        assert (found.course, found.variation) == ("fixed point", 0.0)
        assert found.speed_plastic == found.speed_frozen


def test_who_learns_is_frozen_in_one_of_both_episodes_alone() -> None:
    config = replace(PLASTIC, eta=0.3, init="uniform")
    for found in observe(config, random_champions(config).genomes):
        assert found.variation > 0
        assert found.speed_plastic != found.speed_frozen
