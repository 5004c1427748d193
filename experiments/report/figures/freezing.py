"""What is left of a gait when plasticity is switched off: the paper's Fig. 6 and 10."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from experiments.report import intervals
from experiments.report.figures import curves
from experiments.report.figures.curves import Curve
from experiments.report.finished_runs import FinishedRuns, gather, runs_in
from experiments.runs.names import FREEZING

__all__ = ["Frozen", "frozen_speeds", "normalized_freezing", "true_learning"]

Values = NDArray[np.float64]


@dataclass(frozen=True)
class Frozen:
    """Speeds of controllers whose weights were frozen.

    Attributes:
        runs: The indices of the runs of the condition, shape (R,).
        seconds: The times at which the weights were frozen [s], shape (S,).
        speeds: median over terrains [m/s], shape (R, S); NaN where that is a failed episode.
    """

    runs: NDArray[np.intp]
    seconds: Values
    speeds: Values


def true_learning(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Fig. 6: speed with the weights as they were at some second of an episode."""
    return _figure(run_folders, out, "true_learning", {})


def normalized_freezing(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Fig. 10: as Fig. 6, with normalized weights; a figure for each way to normalize."""
    by_norm = _figure(run_folders, out, "normalized_freezing", {"normalize": "l2"})
    return by_norm + _figure(run_folders, out, "minmax_freezing", {"normalize": "minmax"})


def frozen_speeds(condition: FinishedRuns) -> Frozen | None:
    """What became of frozen weights; None if the condition was not analysed."""
    table = condition.table(FREEZING)
    if table is None:
        return None
    seconds, runs = np.unique(table["second"]), runs_in(table)
    speeds = [
        [
            intervals.middle(table["speed"][(table["run"] == run) & (table["second"] == second)])
            for second in seconds
        ]
        for run in runs
    ]
    return Frozen(runs, seconds, np.array(speeds))


def _figure(
    run_folders: Sequence[Path], out: Path, name: str, variant: dict[str, str]
) -> list[Path]:
    drawn = []
    for each in gather(run_folders):
        config = each.config
        if each.variant != variant or (config.controller, config.damage) != ("hebbian", "none"):
            continue
        if (frozen := frozen_speeds(each)) is not None:
            drawn.append(
                Curve(
                    config.shape,
                    config.sensors,
                    "weights frozen",
                    frozen.seconds,
                    frozen.speeds,
                    reference=intervals.middle(each.fitness),
                )
            )
    caption = (
        "Speed on unseen ground of controllers whose weights were frozen at a second of an episode "
        "[m/s]: median, quartiles and standard deviation over runs. The figure's line of reference "
        "is the speed of the same individuals, still learning, at the end of evolution."
    )
    return curves.draw(
        drawn,
        out,
        name,
        ("weights frozen at [s]", "second"),
        caption,
        reference="still learning",
    )
