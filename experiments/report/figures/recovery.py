"""How champions move after damage: those that evolved with it, and those that never met it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from experiments.report import intervals, tables
from experiments.report.figures import boxes
from experiments.report.figures.overview import TAKEOFF_SPEED
from experiments.report.figures.performance import box, main_models
from experiments.report.finished_runs import FinishedRuns, Table, gather, per_run
from experiments.runs.names import RECOVERY

__all__ = ["recovery", "unforeseen"]

_CAPTION = (
    "Speed after voxels broke [m/s]: medians over runs, of each run its champion's median over "
    "40 unseen terrains, with 95 % bootstrap intervals. "
)
_MEASURES = ("before", "after", "undamaged")


def recovery(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Speed after damage, of champions that evolved with damage."""
    return _recovery(run_folders, out, "recovery", "half", "They evolved with damage.")


def unforeseen(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Speed after damage, of champions that evolved without any."""
    return _recovery(run_folders, out, "unforeseen", "none", "They evolved without damage.")


def _recovery(
    run_folders: Sequence[Path], out: Path, name: str, damage: str, words: str
) -> list[Path]:
    found = [
        (each, table)
        for each in main_models(gather(run_folders), damage)
        if (table := each.table(RECOVERY)) is not None
    ]
    drawn = [box(each, per_run(table, "speed_after")) for each, table in found]
    files = boxes.draw(drawn, out, name, "MLP", _CAPTION + words)
    if not files:
        return []
    caption = (
        "Speeds before damage, after it, and in that time without it on the same terrains [m/s]: "
        f"medians over runs. Share: the second by the third, of the runs that go {TAKEOFF_SPEED:g} "
        f"m/s or more without damage, which are counted. {words}"
    )
    rows = [_row(each, table) for each, table in found]
    return [*files, *tables.write(rows, out, f"{name}_speeds", caption)]


def _row(condition: FinishedRuns, table: Table) -> dict[str, Any]:
    before, after, undamaged = (per_run(table, f"speed_{each}") for each in _MEASURES)
    walking = undamaged >= TAKEOFF_SPEED
    share = intervals.middle((after / undamaged)[walking]) if walking.any() else math.nan
    return {
        "where": condition.where,
        "controller": condition.label,
        "n": len(after),
        "before": intervals.middle(before),
        "after": intervals.middle(after),
        "undamaged": intervals.middle(undamaged),
        "walking": int(walking.sum()),
        "share": share,
    }
