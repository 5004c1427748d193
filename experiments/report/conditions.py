"""Every condition in one line: how fast, how early, at which frequency."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.report import intervals
from experiments.report.figures.gaits import frequency_per_run
from experiments.report.figures.overview import TAKEOFF_SPEED, takeoff_times
from experiments.report.figures.performance import unseen_per_run
from experiments.report.finished_runs import FinishedRuns

__all__ = ["CAPTION", "READABLE_CAPTION", "condition_rows", "readable_rows"]

READABLE_CAPTION = (
    "Medians over runs (slowest to fastest run), speeds in m/s: of the best individual of the last "
    f"generation, and of its median over unseen terrains. Above {TAKEOFF_SPEED:g} m/s: runs that "
    "ever were; from the generation in which half of all runs had been (the first to the last "
    "run). Hz: of gaits that repeat themselves (runs with such a gait)."
)

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


def readable_rows(conditions: Sequence[FinishedRuns]) -> list[dict[str, str]]:
    """The same with fewer and rounded columns, as `READABLE_CAPTION` explains."""
    return [
        {
            "robot, sensors": row["where"],
            "controller": row["controller"],
            "damage": row["damage"],
            "runs": str(row["n"]),
            "speed": _told(row, "speed"),
            "unseen terrains": _told(row, "unseen"),
            f"above {TAKEOFF_SPEED:g} m/s": str(row["took_off"]),
            "from generation": _told_generations(row),
            "Hz": "" if row["frequency"] == "" else f"{row['frequency']:.1f} ({row['periodic']})",
        }
        for row in condition_rows(conditions)
    ]


def _told(row: Mapping[str, Any], name: str) -> str:
    if row[name] == "":
        return ""
    return f"{row[name]:.1f} ({row[f'{name}_min']:.1f} to {row[f'{name}_max']:.1f})"


def _told_generations(row: Mapping[str, Any]) -> str:
    if not row["took_off"]:
        return ""
    half = "never" if row["half"] == "" else row["half"]
    return f"{half} ({row['first']} to {row['last']})"


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
