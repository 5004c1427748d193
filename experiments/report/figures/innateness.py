"""What becomes innate: champions of the course of an evolution, with and without plasticity."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from experiments.report import intervals
from experiments.report.figures import curves
from experiments.report.figures.curves import Curve
from experiments.report.figures.performance import main_models
from experiments.report.finished_runs import FinishedRuns, Table, gather, runs_in
from experiments.runs.names import PAIRED

__all__ = ["innateness"]

_MODES = {"still learning": np.nan, "frozen at 20 s": 20.0, "at 1 s": 1.0, "initial weights": 0.0}


def innateness(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Best individuals of a generation while they learn, and with weights frozen at some time."""
    drawn = []
    for each in main_models(gather(run_folders), "none"):
        table = each.table(PAIRED)
        if table is None or each.config.controller != "hebbian":
            continue
        drawn += _course(each, table)
    caption = (
        "Speed of the best individuals of a generation on the same terrains [m/s], while their "
        "weights change and with weights frozen at a time of an episode on another terrain: "
        "median, quartiles and standard deviation over runs of each run's median."
    )
    axis = ("generation", "generation")
    return curves.draw(drawn, out, "innateness", axis, caption, points=21)


def _course(condition: FinishedRuns, table: Table) -> list[Curve]:
    generations = np.unique(table["generation"])
    found = []
    for label, frozen_at in _MODES.items():
        times = table["frozen_at"]
        of_mode = np.isnan(times) if np.isnan(frozen_at) else times == frozen_at
        if not of_mode.any():
            continue
        values = np.stack(
            [_medians(table, of_mode & (table["generation"] == each)) for each in generations], 1
        )
        config = condition.config
        found.append(Curve(config.shape, config.sensors, label, generations, values))
    return found


def _medians(table: Table, rows: np.ndarray) -> np.ndarray:
    """Each run's median speed over some rows [m/s], shape (runs,)."""
    return np.array(
        [intervals.middle(table["speed"][rows & (table["run"] == run)]) for run in runs_in(table)]
    )
