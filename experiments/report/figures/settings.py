"""The same champions in settings unlike those of their evolution: terrain, damage, gravity."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from experiments.io import style
from experiments.report import intervals
from experiments.report.figures import boxes
from experiments.report.figures.boxes import Box
from experiments.report.figures.performance import main_models
from experiments.report.finished_runs import FinishedRuns, gather, per_run
from experiments.runs.names import GENERALIZATION

__all__ = ["settings"]

_WIDTH, _ROW = 2.2, 0.17  # of a panel and of a setting in it [in]
_APART = 0.16  # of the controllers of a setting, settings being 1 apart


def settings(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Champions on terrains of their evolution, on unseen ones, and in settings unlike those."""
    found = main_models(gather(run_folders), "none")
    drawn = [box for each in found for box in _boxes(each)]
    if not drawn:
        return []
    shapes = list(dict.fromkeys(each.config.shape for each in found))
    apparatuses = list(dict.fromkeys(each.config.sensors for each in found))
    labels = list(dict.fromkeys(box.label for box in drawn))
    names = list(dict.fromkeys(box.sensors for box in drawn))
    size = (_WIDTH, _ROW * len(names) + 0.3)
    with style.sheet(
        out, "settings", size, len(shapes), len(apparatuses), sharex="row", sharey="all"
    ) as sheet:
        for (row, shape), (column, sensors) in itertools.product(
            enumerate(shapes), enumerate(apparatuses)
        ):
            axes = sheet.panel(row, column)
            here = [box for box in drawn if box.shape == f"{shape} {sensors}"]
            _draw_panel(axes, here, names, labels)
            axes.set_title(f"{shape} {sensors}")
            if row == len(shapes) - 1:
                axes.set_xlabel(style.SPEED)
        sheet.panel(0).invert_yaxis()  # the first setting above; the panels share the axis
        sheet.legend(
            [
                Line2D([], [], color=look.color, marker=look.marker, ms=3, label=label)
                for label, look in style.looks(labels).items()
            ]
        )
        counts = style.counted([len(box.values) for box in drawn])
        sheet.note(f"{counts}; marker: median over runs, line: quartiles")
    caption = (
        "Median speed of each run's champion over 30 episodes of a setting [m/s]: terrains of its "
        "own evolution (training), unseen ones of the same kind, other terrains, kinds of damage, "
        "gravity (9.8 m/s^2 in evolution) and friction (1.41 in evolution); medians over runs with "
        "95 % bootstrap intervals."
    )
    comparisons = boxes.compare_with(drawn, "MLP")
    table = boxes.write_table(drawn, comparisons, "MLP", out, "settings", caption)
    return [*sheet.files, *table]


def _boxes(condition: FinishedRuns) -> list[Box]:
    """The runs of a condition in each setting."""
    table = condition.table(GENERALIZATION)
    if table is None:
        return []
    found = []
    for setting in dict.fromkeys(table["setting"].tolist()):
        rows = table["setting"] == setting
        speeds = per_run({name: column[rows] for name, column in table.items()})
        found.append(Box(condition.where, setting, condition.label, speeds))
    return found


def _draw_panel(
    axes: Axes, here: Sequence[Box], names: Sequence[str], labels: Sequence[str]
) -> None:
    looks = style.looks(labels)
    for box in here:
        order = labels.index(box.label)
        y = names.index(box.sensors) + (2 * order - len(labels) + 1) * _APART
        look = looks[box.label]
        axes.plot(intervals.quartiles(box.values), (y, y), color=look.color, lw=1)
        axes.plot([intervals.middle(box.values)], [y], look.marker, color=look.color, ms=3)
    axes.set_yticks(range(len(names)), list(names))
    axes.axvline(0, color="0.8", lw=0.6, zorder=0)
