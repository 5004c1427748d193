"""What the paper only speculates about, or did not ask: pruning, and other worlds."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from experiments.io import style
from experiments.report import intervals, tables
from experiments.report.figures import curves
from experiments.report.figures.curves import Curve
from experiments.report.finished_runs import Table, gather, per_run
from experiments.runs.names import MATRIX, PRUNING

__all__ = ["pruning", "validation_matrix"]

Values = NDArray[np.float64]

_CELL = (0.5, 0.24)  # of a heat map [in]


def pruning(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Speed against the share of synapses cut out: the largest, the smallest, or any."""
    drawn = []
    for each in gather(run_folders):
        table = each.table(PRUNING)
        if table is None:
            continue
        title = "" if each.label == "Hebbian" else f", {each.label}"
        for which in np.unique(table["which"]):
            part = _where(table, "which", which)
            fractions = np.unique(part["fraction"])
            speeds = [per_run(_where(part, "fraction", fraction)) for fraction in fractions]
            drawn.append(
                Curve(
                    each.config.shape,
                    each.config.sensors + title,
                    str(which),
                    fractions,
                    np.stack(speeds, axis=1),
                )
            )
    caption = (
        "Speed on unseen ground without some share of the synapses, by the size of their weights "
        "[m/s]: median, quartiles and standard deviation over runs."
    )
    return curves.draw(drawn, out, "pruning", ("fraction of synapses pruned", "fraction"), caption)


def validation_matrix(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Median speed on every kind of ground, whole and with broken voxels."""
    found = [
        (each, table)
        for each in gather(run_folders)
        if (table := each.table(MATRIX)) is not None and each.config.damage == "none"
    ]
    if not found:
        return []
    terrains = list(dict.fromkeys(name for _, table in found for name in _kinds(table)))
    damages = list(dict.fromkeys(str(name) for _, table in found for name in table["damage"]))
    shapes = list(dict.fromkeys(each.config.shape for each, _ in found))
    columns = max(sum(each.config.shape == shape for each, _ in found) for shape in shapes)
    size = (0.5 + _CELL[0] * len(damages), 0.6 + _CELL[1] * len(terrains))
    with style.sheet(
        out, "validation_matrix", size, rows=len(shapes), columns=columns, sharey="all"
    ) as sheet:
        sheet.figure.suptitle(f"median {style.SPEED}", fontsize=8)
        for row, shape in enumerate(shapes):
            here = [
                (each, _medians(table, terrains, damages))
                for each, table in found
                if each.config.shape == shape
            ]
            # One scale for a shape, so that equal shades are equal speeds.
            most = max(1e-6, *(float(np.nanmax(medians, initial=0.0)) for _, medians in here))
            for i, (each, medians) in enumerate(here):
                axes = sheet.panel(row, i)
                _draw_map(axes, medians, most)
                axes.set_xticks(range(len(damages)), damages)
                axes.set_yticks(range(len(terrains)), terrains)
                axes.set_title(f"{each.config.shape}\n{each.config.sensors}, {each.label}")
                if row == len(shapes) - 1:
                    axes.set_xlabel("damage")
            sheet.panel(row).set_ylabel("terrain")
            for empty in range(len(here), columns):
                sheet.panel(row, empty).set_visible(False)
    rows = [
        {
            "where": each.where,
            "controller": each.label,
            "terrain": ground,
            "damage": damage,
            "median": float(value),
        }
        for each, table in found
        for ground, line in zip(terrains, _medians(table, terrains, damages), strict=True)
        for damage, value in zip(damages, line, strict=True)
    ]
    caption = "Median over runs of each run's median speed over terrains and seeds [m/s]."
    return [*sheet.files, *tables.write(rows, out, "validation_matrix", caption)]


def _where(table: Table, column: str, value: object) -> Table:
    chosen = table[column] == value
    return {name: values[chosen] for name, values in table.items()}


def _kinds(table: Table) -> list[str]:
    return [str(name) for name in table["terrain"]]


def _medians(table: Table, terrains: Sequence[str], damages: Sequence[str]) -> Values:
    """Shape (terrains, damages), NaN where there is nothing."""
    medians = np.full((len(terrains), len(damages)), np.nan)
    for i, ground in enumerate(terrains):
        for j, damage in enumerate(damages):
            cell = _where(_where(table, "terrain", ground), "damage", damage)
            if len(cell["run"]):
                medians[i, j] = intervals.middle(per_run(cell))
    return medians


def _draw_map(axes: Axes, medians: Values, most: float) -> None:
    axes.imshow(np.nan_to_num(medians), cmap="cividis", vmin=0, vmax=most, aspect="auto")
    for (i, j), value in np.ndenumerate(medians):
        text = "–" if np.isnan(value) else f"{value:z.1f}"  # no "-0.0"
        color = "black" if value > most / 2 else "white"
        axes.text(j, i, text, ha="center", va="center", fontsize=6, color=color)
