"""What came out for a claim: place by place, and all in all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from experiments.report.intervals import Estimate

__all__ = ["MIN_RUNS", "Finding", "Place", "Side", "Verdict", "conclude", "interval", "number"]

Verdict = Literal["supported", "contradicted", "open"]
Side = Literal["for", "against", "neither"]

MIN_RUNS = 10
"""Runs of every condition without which nothing is decided."""


@dataclass(frozen=True)
class Finding:
    """What came out.

    Attributes:
        verdict: The verdict on the claim.
        reason: The reason for the verdict.
        tendency: what the runs point to, place by place, whatever the verdict.
        measured: a line for each place.
    """

    verdict: Verdict
    reason: str
    tendency: str
    measured: tuple[str, ...]


@dataclass(frozen=True)
class Place:
    """What came out at one place.

    Attributes:
        where: The name of the place.
        says: about the claim, were it decided here alone.
        n_runs: The number of runs of the smaller sample.
        leans: Whether the numbers lean to the claim, significantly or not.
        tendency: a number that shows it.
        measured: a line with all numbers.
    """

    where: str
    says: Side
    n_runs: int
    leans: bool
    tendency: str
    measured: str

    @property
    def decided(self) -> Side:
        """What it says, if there are runs enough to say it."""
        return self.says if self.n_runs >= MIN_RUNS else "neither"


def conclude(
    places: Sequence[Place], samples: Mapping[str, object], needed: str, kind: str = "A12 "
) -> Finding:
    """The verdict on a claim.

    Args:
        places: where something was measured.
        samples: The values of the runs by place, of all places that the claim is about.
        needed: what supports the claim at a place, in words.
        kind: What the numbers that show the tendency are, such as "medians ".
    """
    measured = tuple(place.measured for place in places)
    tendency = ""
    if places:
        values = ", ".join(place.tendency for place in places)
        leaning = sum(place.leans for place in places)
        tendency = f"as claimed at {leaning} of {len(places)} place(s): {kind}{values}"
    against = [place.where for place in places if place.decided == "against"]
    if against:
        reason = f"significantly otherwise: {_list(against, samples)}"
        return Finding("contradicted", reason, tendency, measured)
    missing = [where for where in samples if where not in {place.where for place in places}]
    neither = [place for place in places if place.decided == "neither"]
    if places and not missing and not neither:
        return Finding("supported", f"{needed} at every place", tendency, measured)
    few = [place.where for place in neither if place.n_runs < MIN_RUNS]
    reasons = {
        "not measured": missing,
        f"fewer than {MIN_RUNS} runs": few,
        f"without {needed}": [place.where for place in neither if place.where not in few],
    }
    reason = "; ".join(f"{why}: {_list(each, samples)}" for why, each in reasons.items() if each)
    return Finding("open", reason, tendency, measured)


def interval(estimate: Estimate) -> str:
    """Its bounds, in brackets."""
    return f"[{number(estimate.low)}, {number(estimate.high)}]"


def number(value: float) -> str:
    """Three significant digits."""
    return "n/a" if np.isnan(value) else f"{value:.3g}".replace("inf", "∞")


def _list(places: Sequence[str], samples: Mapping[str, object]) -> str:
    return "everywhere" if len(places) == len(samples) else ", ".join(places)
