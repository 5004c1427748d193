"""How champions move after damage: those that evolved with it, and those that never met it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from experiments.report import intervals
from experiments.report.figures import boxes
from experiments.report.figures.boxes import Box
from experiments.report.figures.overview import TAKEOFF_SPEED
from experiments.report.figures.performance import box, main_models
from experiments.report.finished_runs import FinishedRuns, Table, gather, per_run
from experiments.runs.names import RECOVERY

__all__ = ["recovery", "unforeseen"]

_CAPTION = (
    "Speed after voxels broke [m/s]: medians over runs, of each run its champion's median over "
    "40 unseen terrains, with 95 % bootstrap intervals. Beside it the speed before, and on the "
    "same terrains in the time after without damage; `share` is the speed after damage as a share "
    f"of that, of the runs that go {TAKEOFF_SPEED:g} m/s or more undamaged (`walking`). "
)


def recovery(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Speed after damage, of champions that evolved with damage."""
    return _recovery(run_folders, out, "recovery", "half", "They evolved with damage.")


def unforeseen(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Speed after damage, of champions that evolved without any."""
    return _recovery(run_folders, out, "unforeseen", "none", "They evolved without damage.")


def _recovery(
    run_folders: Sequence[Path], out: Path, name: str, damage: str, words: str
) -> list[Path]:
    drawn = [
        _box(each, table)
        for each in main_models(gather(run_folders), damage)
        if (table := each.table(RECOVERY)) is not None
    ]
    return boxes.draw(drawn, out, name, "MLP", _CAPTION + words)


def _box(condition: FinishedRuns, table: Table) -> Box:
    before, after, undamaged = (
        per_run(table, f"speed_{each}") for each in ("before", "after", "undamaged")
    )
    walking = undamaged >= TAKEOFF_SPEED
    more = {
        "before": intervals.middle(before),
        "undamaged": intervals.middle(undamaged),
        "walking": int(walking.sum()),
        "share": intervals.middle((after / undamaged)[walking]) if walking.any() else math.nan,
    }
    return replace(box(condition, after), more=more)
