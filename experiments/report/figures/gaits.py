"""How fast controllers are at which frequency of their gaits."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from experiments.io import style
from experiments.report import intervals, tables
from experiments.report.finished_runs import FinishedRuns, Table, gather
from experiments.runs.names import GAITS

__all__ = ["frequency_per_run", "gaits"]

_PANEL = (2.6, 2.2)  # [in]
_MEASURES = ("vibration", "saturated", "alternating", "speed")

Values = NDArray[np.float64]


def gaits(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Speed of each run's best individual against the frequency of its gait."""
    found = [
        (each, table)
        for each in gather(run_folders)
        if each.config.damage == "none" and (table := each.table(GAITS)) is not None
    ]
    if not found:
        return []
    shapes = list(dict.fromkeys(each.config.shape for each, _ in found))
    columns = list(dict.fromkeys(each.config.sensors for each, _ in found))
    labels = list(dict.fromkeys(each.full_label for each, _ in found))
    marks: dict[str, dict[str, Any]] = {
        label: {"marker": look.marker, "color": look.color, "mec": "black", "mew": 0.4}
        for label, look in style.looks(labels).items()
    }
    size = (len(shapes), len(columns))
    with style.sheet(out, "gaits", _PANEL, *size, sharex="all", sharey="row") as sheet:
        for (row, shape), (column, sensors) in itertools.product(
            enumerate(shapes), enumerate(columns)
        ):
            axes = sheet.panel(row, column)
            axes.set(title=f"{shape} {sensors}", xscale="log")
            for each, table in found:
                if (each.config.shape, each.config.sensors) == (shape, sensors):
                    frequency, speed = (
                        _per_run(table, name) for name in ("gait_frequency", "speed")
                    )
                    axes.plot(frequency, speed, ls="", ms=4, alpha=0.8, **marks[each.full_label])
            if row == len(shapes) - 1:
                axes.set_xlabel("frequency of the gait [Hz]")
            if column == 0:
                axes.set_ylabel(style.SPEED)
        sheet.legend([Line2D([], [], ls="", label=label, **marks[label]) for label in labels])
        sheet.note(
            f"{style.counted([len(each.fitness) for each, _ in found])}; medians over unseen "
            "terrains; runs whose gait does not repeat itself are not shown"
        )
    caption = (
        "Gaits of each run's best individual on terrains that its evolution never met: frequency "
        "[Hz], share of the variance of the body's areas above 4 Hz (vibration), of the commands "
        "beyond 0.9 (saturated), of the time in the two commonest postures (alternating), speed "
        "[m/s]. "
        "Medians over terrains, then over runs with 95 % bootstrap intervals; `periodic` is the "
        "number of runs with a gait that repeats itself on most terrains."
    )
    rows = [_row(each, table) for each, table in found]
    return [*sheet.files, *tables.write(rows, out, "gaits", caption)]


def frequency_per_run(condition: FinishedRuns) -> Values:
    """Frequency of each run's gait [Hz], NaN where it does not repeat itself; empty if the
    condition lacks the analysis."""
    table = condition.table(GAITS)
    return np.empty(0) if table is None else _per_run(table, "gait_frequency")


def _row(condition: FinishedRuns, table: Table) -> dict[str, Any]:
    frequency = _per_run(table, "gait_frequency")
    periodic = frequency[np.isfinite(frequency)]
    row: dict[str, Any] = {
        "where": condition.where,
        "controller": condition.full_label,
        "n": len(frequency),
        "periodic": len(periodic),
    }
    of_runs = {name: _per_run(table, name) for name in _MEASURES}
    for name, values in ({"frequency": periodic} | of_runs).items():
        values = values[np.isfinite(values)]
        if len(values):
            middle = intervals.median(values)
            row |= {name: middle.value, f"{name}_low": middle.low, f"{name}_high": middle.high}
    return row


def _per_run(table: Table, name: str) -> Values:
    """Median of each run over its terrains; NaN where fewer than half have such a number."""
    runs = np.unique(table["run"])
    medians = np.full(len(runs), np.nan)
    for i, run in enumerate(runs):
        values = table[name][table["run"] == run]
        known = values[np.isfinite(values)]
        if 2 * len(known) >= len(values):
            medians[i] = np.median(known)
    return medians
