"""What claims are about: numbers of finished runs, one for each run of a condition."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.analysis.generalization import TRAINING, UNSEEN
from experiments.report import intervals
from experiments.report.claims.verdicts import MARGIN
from experiments.report.figures import recordings
from experiments.report.figures.freezing import Frozen, frozen_speeds
from experiments.report.figures.performance import unseen_per_run
from experiments.report.finished_runs import FinishedRuns, per_run
from experiments.runs.names import GENERALIZATION, PAIRED

__all__ = [
    "SETTLED",
    "Measure",
    "Results",
    "bimodality",
    "cycle_over_gait",
    "fitness",
    "gait_period",
    "generations_to_converge",
    "kept_frozen",
    "kept_on_unseen",
    "kurtosis",
    "second_settled",
    "speed_on_unseen",
    "weight_growth",
]

Values = NDArray[np.float64]
Measure = Callable[[FinishedRuns], Values]
"""One number per run; empty if the condition lacks the analysis."""

SETTLED = 20.0
"""Second by which the paper's Fig. 6 is flat."""

_CONVERGED = 0.9  # of the final speed


class Results:
    """Finished runs, by what was evolved."""

    def __init__(self, conditions: Sequence[FinishedRuns]) -> None:
        self.conditions = conditions

    def find(
        self,
        body: tuple[str, str],
        controller: str = "hebbian",
        damage: str = "none",
        variant: Mapping[str, Any] | None = None,
    ) -> FinishedRuns | None:
        """The condition of a body (shape, apparatus), or None if it has no finished run."""
        wanted = (body, controller, damage, dict(variant or {}))
        for each in self.conditions:
            config = each.config
            found = ((config.shape, config.sensors), config.controller, config.damage, each.variant)
            if found == wanted:
                return each
        return None


def fitness(condition: FinishedRuns) -> Values:
    """Speed of the best individual at the end of evolution [m/s]."""
    return condition.fitness


def speed_on_unseen(condition: FinishedRuns) -> Values:
    """Median speed on unseen terrains [m/s]."""
    return unseen_per_run(condition)


def kept_on_unseen(condition: FinishedRuns) -> Values:
    """Median speed on unseen terrains as a share of that on terrains of the evolution.

    Both are re-assessments: the fitness in evolution is the best of a population, which a
    re-assessment on the very same terrains would not reach either.
    """
    table = condition.table(GENERALIZATION)
    if table is None:
        return np.empty(0)
    familiar, unseen = (
        per_run({name: column[table["setting"] == each] for name, column in table.items()})
        for each in (TRAINING, UNSEEN)
    )
    return _share(unseen, familiar)


def generations_to_converge(condition: FinishedRuns) -> Values:
    """First generation whose best reaches 90 % of the mean best of the run's last tenth."""
    best = np.nan_to_num(condition.curves(), nan=-np.inf)
    if not best.size:
        return np.empty(0)
    final = best[:, -max(1, best.shape[1] // 10) :].mean(axis=1, keepdims=True)
    return (best >= _CONVERGED * final).argmax(axis=1) + 1.0


def kept_frozen(condition: FinishedRuns) -> Values:
    """Median speed with weights frozen at 20 s, as a share of that of the same champions, still
    plastic, on the same terrains."""
    table = condition.table(PAIRED)
    if table is None:
        return np.empty(0)
    last = table["generation"] == table["generation"].max()
    frozen, plastic = (
        per_run({name: column[last & rows] for name, column in table.items()})
        for rows in (table["frozen_at"] == SETTLED, np.isnan(table["frozen_at"]))
    )
    return _share(frozen, plastic) if len(frozen) else np.empty(0)


def second_settled(condition: FinishedRuns) -> Values:
    """First second [s] whose frozen weights reach the later speed but for the margin."""
    frozen = _settling(condition)
    if frozen is None:
        return np.empty(0)
    plateau = _plateau(frozen)
    reached = np.nan_to_num(frozen.speeds, nan=-np.inf) >= (1 - MARGIN) * plateau[:, None]
    first: Values = frozen.seconds[reached.argmax(axis=1)]
    return np.where(plateau > 0, first, np.nan)  # what does not walk has not settled


def weight_growth(condition: FinishedRuns, *, random: bool = False) -> Values:
    """Largest |w| at the end of an episode over that at a quarter of it.

    Args:
        condition: what was evolved.
        random: Whether to take random genomes in place of the champions; likewise in the next two.
    """
    return _of_lives(
        condition,
        lambda life: life["weights"][-1]["largest"] / life["weights"][1]["largest"],
        random,
    )


def kurtosis(condition: FinishedRuns, *, random: bool = False) -> Values:
    """Excess kurtosis of the weights at the end of an episode."""
    return _of_lives(condition, lambda life: _number(life["weights"][-1]["kurtosis"]), random)


def bimodality(condition: FinishedRuns, *, random: bool = False) -> Values:
    """Twice the smaller of the shares of activations below -0.9 and above 0.9: 1 if all activations
    are saturated, evenly on both sides; mean of the hidden and the output layer."""
    return _of_lives(
        condition,
        lambda life: float(
            np.mean([2 * min(layer["low"], layer["high"]) for layer in life["layers"].values()])
        ),
        random,
    )


def gait_period(condition: FinishedRuns) -> Values:
    """Period of the body's gait [s], NaN where it has none."""
    return _of_lives(condition, lambda life: _number(life["gait_period"]))


def cycle_over_gait(condition: FinishedRuns) -> Values:
    """Period of the output neurons over that of the gait, NaN where either has none."""
    return _of_lives(
        condition,
        lambda life: _number(life["layers"]["output"]["period"]) / _number(life["gait_period"]),
    )


def _settling(condition: FinishedRuns) -> Frozen | None:
    """Frozen speeds, if they were measured for long enough to settle."""
    frozen = frozen_speeds(condition)
    return frozen if frozen is not None and (frozen.seconds >= SETTLED).any() else None


def _plateau(frozen: Frozen) -> Values:
    """Each run's median speed from `SETTLED` on."""
    late = frozen.speeds[:, frozen.seconds >= SETTLED]
    return np.array([intervals.middle(own) for own in late])


def _of_lives(
    condition: FinishedRuns, measure: Callable[[dict[str, Any]], float], random: bool = False
) -> Values:
    observed = recordings.random_measures if random else recordings.measures
    return np.array([measure(life) for life in observed(condition)])


def _number(value: float | None) -> float:
    return float("nan") if value is None else value


def _share(part: Values, whole: Values) -> Values:
    """Part over whole, NaN where the whole is not positive."""
    return part / np.where(whole > 0, whole, np.nan)
