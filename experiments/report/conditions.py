"""Every condition in one line: how fast, how early, at which frequency."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.report import intervals
from experiments.report.figures.gaits import frequency_per_run
from experiments.report.figures.overview import TAKEOFF_SPEED, takeoff_times
from experiments.report.figures.performance import unseen_per_run
from experiments.report.finished_runs import FinishedRuns

__all__ = ["CAPTION", "condition_rows"]

CAPTION = (
    "Medians over runs, with the slowest and the fastest run; speeds in m/s. `speed`: the best "
    "individual of the last generation; `unseen`: its median over terrains that evolution never "
    f"met; `took_off`: runs whose best was ever faster than {TAKEOFF_SPEED:g} m/s, from generation "
    "`first` to `last`, half of all runs by `half`; `frequency` of the gait [Hz], of the "
    "`periodic` runs whose gait repeats itself. Empty: not measured."
)

Values = NDArray[np.float64]


def condition_rows(conditions: Sequence[FinishedRuns]) -> list[dict[str, Any]]:
    """A row for each condition, as `CAPTION` explains."""
    return [_row(condition) for condition in conditions]


def _row(condition: FinishedRuns) -> dict[str, Any]:
    frequency = frequency_per_run(condition)
    periodic = frequency[np.isfinite(frequency)]
    return {
        "where": condition.where,
        "controller": condition.full_label,
        "damage": condition.config.damage,
        "n": len(condition.fitness),
        **_spread("speed", condition.fitness),
        **_spread("unseen", unseen_per_run(condition)),
        **_takeoff(condition),
        "periodic": len(periodic) if len(frequency) else "",
        "frequency": intervals.middle(periodic) if len(periodic) else "",
    }


def _spread(name: str, values: Values) -> dict[str, Any]:
    known = values[np.isfinite(values)]
    if not len(known):
        return {name: "", f"{name}_min": "", f"{name}_max": ""}
    return {
        name: intervals.middle(values),
        f"{name}_min": float(known.min()),
        f"{name}_max": float(known.max()),
    }


def _takeoff(condition: FinishedRuns) -> dict[str, Any]:
    times = takeoff_times(condition)
    if not len(times):
        return dict.fromkeys(("took_off", "first", "half", "last"), "")
    found = times.times[times.happened]
    half = times.median
    return {
        "took_off": len(found),
        "first": int(found.min()) if len(found) else "",
        "half": "" if math.isnan(half) else int(half),
        "last": int(found.max()) if len(found) else "",
    }
