"""The claims of the paper, each with the measurement that decides it.

All bounds were stated before any result was seen: `verdicts.MARGIN` for "not worse" and "no
difference", and those below. What is measured for claims 6, 9 and 14 to 17 was changed with version
2 of the rules, for reasons that do not depend on results: speeds are compared on the same terrains,
in place of the best of a population; both ways to normalize are judged; periods come from spectra.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from experiments.report.claims import judges, measures, verdicts
from experiments.report.claims.finding import Finding
from experiments.report.claims.judges import BIPED, EVERYWHERE, HIGH, WORM
from experiments.report.claims.measures import Results
from experiments.report.claims.verdicts import MARGIN

__all__ = ["CLAIMS", "Claim"]

_PAIRED = (
    "speed with weights frozen at 20 s as a share of that while still learning, on the same 30 "
    "terrains"
)
_KEPT_FROZEN = 0.5  # of the speed while learning
_SETTLE_BY = {BIPED: 20.0, WORM: 10.0}  # [s], twice the paper's 10 and 5
_GROWTH = 2.0  # of the largest weight between 15 and 60 s; steady divergence gives 4
_BIMODAL = 0.5  # of the activations
_GAIT = {BIPED: 1.5, WORM: 2.0}  # [s], Sec. IV-C


@dataclass(frozen=True)
class Claim:
    """A claim of the paper.

    Attributes:
        number: The number of the claim; "14a" and "14b" are one sentence of the paper, read in two
            ways.
        source: where in the paper.
        says: the claim, one sentence.
        test: what is measured, and what would support the claim.
        judge: gives the verdict on results.
    """

    number: str
    source: str
    says: str
    test: str
    judge: Callable[[Results], Finding]


def _beside_random(measure: Callable[..., Any], least: float) -> Callable[[Results], Finding]:
    """Judge a measure of the dynamics of champions, and tell that of random genomes beside it."""
    return partial(
        judges.of_runs,
        measure=measure,
        bounds=judges.at_least(least),
        reference=partial(measure, random=True),
    )


def _normalized(letter: str, how: str, normalize: str) -> list[Claim]:
    """What the paper claims of normalized weights (Sec. IV-C), for one way to normalize them."""
    variant = {"normalize": normalize}
    return [
        Claim(
            f"14{letter}",
            "Fig. 8, Sec. IV-C",
            f"Normalizing the weights (by {how}) does not impact performance.",
            "best speed of each run; normalized not below full by more than 20 %",
            partial(
                judges.against_full,
                judge=verdicts.not_lower,
                variant=variant,
                name="normalized",
                bodies=HIGH,
            ),
        ),
        Claim(
            f"15{letter}",
            "Fig. 10, Sec. IV-C",
            f"With normalization (by {how}) learning does not stabilize: frozen weights give no "
            "locomotion.",
            f"{_PAIRED}; at most 0.2",
            partial(
                judges.of_runs,
                measure=measures.kept_frozen,
                bounds=judges.at_most(MARGIN),
                variant=variant,
            ),
        ),
        Claim(
            f"16{letter}",
            "Sec. IV-C",
            f"With normalization (by {how}) the gait has a period of about 1.5 s (biped) and 2 s "
            "(worm).",
            "period of the peak in the spectrum of the voxels' areas; within 20 % of these",
            partial(
                judges.of_runs,
                measure=measures.gait_period,
                bounds=lambda shape: judges.about(_GAIT[shape]),
                variant=variant,
                undefined="left out",
            ),
        ),
        Claim(
            f"17{letter}",
            "Sec. IV-C",
            f"With normalization (by {how}) the activations cycle with the gait.",
            "period of the output neurons over that of the gait; within 20 % of 1",
            partial(
                judges.of_runs,
                measure=measures.cycle_over_gait,
                bounds=lambda shape: judges.about(1.0),
                variant=variant,
                undefined="left out",
            ),
        ),
    ]


CLAIMS: Sequence[Claim] = (
    Claim(
        "1",
        "Fig. 2, Sec. IV-A",
        "At the end of evolution, Hebbian learning is never worse than the MLP.",
        "best speed of each run; Hebbian not below MLP by more than 20 % of its median",
        partial(judges.never_worse, measure=measures.fitness),
    ),
    Claim(
        "2",
        "Fig. 2, Sec. IV-A",
        "With the low apparatus, Hebbian learning is far better.",
        "best speed of each run, Hebbian higher than twice the MLP",
        judges.far_better_with_low,
    ),
    Claim(
        "3",
        "Fig. 2, Sec. IV-A",
        "The biped benefits from learning more than the worm.",
        "gain over the MLP as a share of the Hebbian median; biped's higher",
        judges.biped_gains_more,
    ),
    Claim(
        "4",
        "Fig. 4, Sec. IV-A",
        "Hebbian learning converges as fast as the MLP.",
        "generations to 90 % of a run's final speed; not above the MLP's by more than 20 %",
        judges.converges_as_fast,
    ),
    Claim(
        "5",
        "Fig. 3, Sec. IV-A",
        "On unseen terrains, Hebbian learning is never worse than the MLP.",
        "median over 40 or 10 unseen terrains of each run; Hebbian not below MLP by more than 20 %",
        partial(judges.never_worse, measure=measures.speed_on_unseen),
    ),
    Claim(
        "6",
        "Fig. 3, Sec. IV-A",
        "Evolved Hebbian controllers generalize to unseen terrains.",
        "speed on 30 unseen terrains as a share of that on 30 terrains of the evolution; at least "
        "0.8",
        partial(
            judges.of_runs,
            measure=measures.kept_on_unseen,
            bounds=judges.at_least(1 - MARGIN),
            bodies=EVERYWHERE,
        ),
    ),
    Claim(
        "7",
        "Fig. 5, Sec. IV-A",
        "With damage, Hebbian learning is decisively better than the MLP.",
        "evolved and re-assessed with damage, median over 40 or 10 unseen terrains; Hebbian higher",
        judges.better_when_damaged,
    ),
    Claim(
        "8",
        "Sec. IV-A",
        "Results with damage are not significantly different from those without.",
        "best speed of each run, Hebbian, evolved with and without damage; within 20 %",
        judges.damage_changes_nothing,
    ),
    Claim(
        "9",
        "Fig. 6, Sec. IV-B",
        "Learning is true: robots go on walking when their weights are frozen.",
        f"{_PAIRED}; at least 0.5",
        partial(judges.of_runs, measure=measures.kept_frozen, bounds=judges.at_least(_KEPT_FROZEN)),
    ),
    Claim(
        "10",
        "Fig. 6, Sec. IV-B",
        "Learning takes about 10 s (biped) and 5 s (worm).",
        "first second whose frozen weights reach 80 % of the later speed; at most 20 s and 10 s",
        partial(
            judges.of_runs,
            measure=measures.second_settled,
            bounds=lambda shape: (0, _SETTLE_BY[shape]),
        ),
    ),
    Claim(
        "11",
        "Fig. 7, Sec. IV-C",
        "Weights diverge over the whole life.",
        "largest |w| at 60 s over that at 15 s; at least 2",
        _beside_random(measures.weight_growth, _GROWTH),
    ),
    Claim(
        "12",
        "Fig. 7, Sec. IV-C",
        "Weights end up in a bell with small clusters of very large values.",
        "excess kurtosis of the weights at 60 s; above 0",
        _beside_random(measures.kurtosis, 0.0),
    ),
    Claim(
        "13",
        "Sec. IV-C",
        "Activations are bimodal: the neurons are saturated.",
        "twice the smaller of the shares below -0.9 and above 0.9, mean of layers; at least 0.5",
        _beside_random(measures.bimodality, _BIMODAL),
    ),
    *_normalized("a", "the Euclidean norm of the text", "l2"),
    *_normalized("b", "the least and greatest weight of the code", "minmax"),
    Claim(
        "18",
        "Sec. IV-D",
        "Evolving the learning rate makes no difference.",
        "best speed of each run; within 20 % of the full model",
        partial(
            judges.against_full, judge=verdicts.alike, variant={"eta": "evolved"}, name="η evolved"
        ),
    ),
    Claim(
        "19",
        "Sec. IV-D",
        "The single, sensors and post-synaptic models are ineffective everywhere.",
        "best speed of each run as a share of the full model's median; at most 0.2",
        judges.ineffective,
    ),
    Claim(
        "20",
        "Sec. IV-D",
        "The pre-synaptic model evolves, but under-performs the full model.",
        "best speed of each run; full model higher",
        judges.presynaptic_below_full,
    ),
    Claim(
        "21",
        "Sec. IV-D",
        "Weights drawn from U(-1, 1) at the beginning make no difference.",
        "best speed of each run; within 20 % of the full model",
        partial(
            judges.against_full, judge=verdicts.alike, variant={"init": "uniform"}, name="U(-1, 1)"
        ),
    ),
)
