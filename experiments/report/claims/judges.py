"""What each claim takes from the runs, and the rule that judges it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from experiments.report import intervals
from experiments.report.claims import measures, verdicts
from experiments.report.claims.finding import Finding, number
from experiments.report.claims.measures import Measure, Results
from experiments.report.claims.verdicts import MARGIN
from experiments.report.finished_runs import FinishedRuns

__all__ = [
    "BIPED",
    "EVERYWHERE",
    "HIGH",
    "WORM",
    "about",
    "against_full",
    "at_least",
    "at_most",
    "better_when_damaged",
    "biped_gains_more",
    "converges_as_fast",
    "damage_changes_nothing",
    "far_better_with_low",
    "ineffective",
    "never_worse",
    "of_runs",
    "presynaptic_below_full",
]

Values = NDArray[np.float64]
Body = tuple[str, str]
Pairs = dict[str, tuple[Values, Values] | None]

BIPED, WORM = "biped-4x3", "worm-7x1"
_SENSORS = ("low", "medium", "high")
EVERYWHERE = [(shape, sensors) for shape in (BIPED, WORM) for sensors in _SENSORS]
_LOW = [(shape, "low") for shape in (BIPED, WORM)]
HIGH = [(shape, "high") for shape in (BIPED, WORM)]  # the paper shows no more from Fig. 6 on

_MODELS = ("Hebbian", "MLP")
_PLAIN: Mapping[str, Any] = {}
_SHARED = {"single": "single", "grouped": "sensors", "postsynaptic": "post-synaptic"}
_FAR = 2.0  # times the other's speed


def never_worse(results: Results, measure: Measure) -> Finding:
    """Judge that Hebbian is not below the MLP by more than the margin."""
    return verdicts.not_lower(_with_mlp(results, EVERYWHERE, measure), _MODELS)


def far_better_with_low(results: Results) -> Finding:
    """Judge that Hebbian is higher than twice the MLP with the low apparatus."""
    pairs = _with_mlp(results, _LOW, measures.fitness)
    doubled = {
        where: pair and (pair[0], _FAR * np.maximum(pair[1], 0.0)) for where, pair in pairs.items()
    }
    return verdicts.higher(doubled, ("Hebbian", "MLP times 2"))


def biped_gains_more(results: Results) -> Finding:
    """Judge that the biped's gain over the MLP is greater than the worm's."""
    biped, worm = (
        {
            sensors: _pair(
                results.find((shape, sensors)),
                results.find((shape, sensors), "mlp"),
                measures.fitness,
            )
            for sensors in _SENSORS
        }
        for shape in (BIPED, WORM)
    )
    return verdicts.greater_gain(biped, worm, (BIPED, WORM))


def converges_as_fast(results: Results) -> Finding:
    """Judge that Hebbian needs no more generations than the MLP, but for the margin."""
    pairs = _with_mlp(results, EVERYWHERE, measures.generations_to_converge)
    return verdicts.not_higher(pairs, _MODELS)


def better_when_damaged(results: Results) -> Finding:
    """Judge that Hebbian, evolved with damage, is higher than the MLP on unseen terrains."""
    pairs = _with_mlp(results, EVERYWHERE, measures.speed_on_unseen, damage="half")
    return verdicts.higher(pairs, _MODELS)


def damage_changes_nothing(results: Results) -> Finding:
    """Judge that Hebbian evolved with damage is as fast as without."""
    pairs = {
        _name(body): _pair(results.find(body, damage="half"), results.find(body), measures.fitness)
        for body in EVERYWHERE
    }
    return verdicts.alike(pairs, ("with damage", "without"))


def of_runs(
    results: Results,
    measure: Measure,
    bounds: Callable[[str], tuple[float, float]],
    bodies: Sequence[Body] = HIGH,
    variant: Mapping[str, Any] = _PLAIN,
    undefined: Literal["worst", "left out"] = "worst",
    reference: Measure | None = None,
) -> Finding:
    """Judge that a measure lies within bounds, which depend on the shape, for every body.

    What the reference, random genomes, gives is told beside it and decides nothing: a claim that
    holds of them as well is true, and no result of evolution.
    """
    found = {body: results.find(body, variant=variant) for body in bodies}
    samples = {_name(body): None if c is None else measure(c) for body, c in found.items()}
    limits = {_name(body): bounds(body[0]) for body in bodies}
    finding = verdicts.within(samples, limits, undefined)
    if reference is None:
        return finding
    random = [
        f"{_name(body)}: random genomes, median {number(intervals.middle(values))} of {len(values)}"
        for body, condition in found.items()
        if condition is not None and len(values := reference(condition))
    ]
    return replace(finding, measured=(*finding.measured, *random))


def against_full(
    results: Results,
    judge: Callable[[Pairs, tuple[str, str]], Finding],
    variant: Mapping[str, Any],
    name: str,
    bodies: Sequence[Body] = EVERYWHERE,
) -> Finding:
    """Judge the final speed of a variant, first, against the full model's, second."""
    pairs = {
        _name(body): _pair(
            results.find(body, variant=variant), results.find(body), measures.fitness
        )
        for body in bodies
    }
    return judge(pairs, (name, "full"))


def ineffective(results: Results) -> Finding:
    """Judge that models with few rules reach next to nothing of the full model's speed."""
    samples: dict[str, Values | None] = {}
    for sharing, name in _SHARED.items():
        for body in EVERYWHERE:
            full = results.find(body)
            shared = results.find(body, variant={"sharing": sharing})
            known = full is not None and shared is not None
            samples[f"{_name(body)} {name}"] = _relative(shared, full) if known else None
    return verdicts.within(samples, dict.fromkeys(samples, (-math.inf, MARGIN)))


def presynaptic_below_full(results: Results) -> Finding:
    """Judge that the full model is higher than the pre-synaptic one."""
    pairs = {
        _name(body): _pair(
            results.find(body),
            results.find(body, variant={"sharing": "presynaptic"}),
            measures.fitness,
        )
        for body in EVERYWHERE
    }
    return verdicts.higher(pairs, ("full", "pre-synaptic"))


def _with_mlp(
    results: Results, bodies: Sequence[Body], measure: Measure, damage: str = "none"
) -> Pairs:
    return {
        _name(body): _pair(
            results.find(body, "hebbian", damage), results.find(body, "mlp", damage), measure
        )
        for body in bodies
    }


def _pair(
    first: FinishedRuns | None, second: FinishedRuns | None, measure: Measure
) -> tuple[Values, Values] | None:
    if first is None or second is None:
        return None
    return measure(first), measure(second)


def _relative(part: FinishedRuns | None, whole: FinishedRuns | None) -> Values:
    """Speeds of one as shares of the other's median, NaN if that is not positive."""
    assert part is not None
    assert whole is not None
    middle = intervals.middle(whole.fitness)
    return part.fitness / (middle if middle > 0 else math.nan)


def _name(body: Body) -> str:
    return " ".join(body)


def at_least(bound: float) -> Callable[[str], tuple[float, float]]:
    """Bounds for every shape."""
    return lambda shape: (bound, math.inf)


def at_most(bound: float) -> Callable[[str], tuple[float, float]]:
    """Bounds for every shape."""
    return lambda shape: (-math.inf, bound)


def about(target: float) -> tuple[float, float]:
    """Within the margin of a target."""
    return (1 - MARGIN) * target, (1 + MARGIN) * target
