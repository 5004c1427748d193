"""Median and quartiles over runs against time, a panel for each shape and apparatus."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from experiments.io import style
from experiments.report import intervals, tables

__all__ = ["Curve", "draw"]

Values = NDArray[np.float64]

_PANEL = (2.2, 1.7)  # [in]
_REFERENCE: dict[str, Any] = {"color": "black", "ls": (0, (1, 2)), "lw": 0.9}


@dataclass(frozen=True)
class Curve:
    """One curve.

    Attributes:
        shape: the row of its panel.
        column: the column of its panel, such as the apparatus.
        label: The name of the controller.
        x: The abscissas, shape (points,).
        values: shape (runs, points) [m/s]; NaN where a run has none or failed.
        reference: a speed to compare with, a line across the panel [m/s].
    """

    shape: str
    column: str
    label: str
    x: Values
    values: Values
    reference: float | None = None

    @property
    def median(self) -> Values:
        """Over runs, failed ones being worst; NaN where that is a failed one, shape (points,)."""
        return np.array([intervals.middle(each) for each in self.values.T])

    @property
    def quartiles(self) -> tuple[Values, Values]:
        """Lower and upper quartile over runs, failed ones being worst, each of shape (points,).

        A standard deviation would lead beyond what is possible where few runs are far away.
        """
        low, high = np.array([intervals.quartiles(each) for each in self.values.T]).T
        return low, high

    @property
    def deviation(self) -> Values:
        """Standard deviation over runs, shape (points,); NaN for fewer than two."""
        return np.array([intervals.spread(each) for each in self.values.T])


def draw(
    curves: Sequence[Curve],
    out: Path,
    name: str,
    x_axis: tuple[str, str],
    caption: str = "",
    points: int = 61,
    reference: str = "",
) -> list[Path]:
    """Draw the medians of curves within their quartiles, and write the table of their points.

    Args:
        curves: labels in the order of their first appearance.
        out: an existing folder.
        name: The name of the files.
        x_axis: the label, with its unit, and the name of the table's column.
        caption: The caption of the table.
        points: The most points of a curve that go into the table, evenly spaced.
        reference: what the curves' references are.

    Returns:
        The files; none if there are no curves.
    """
    if not curves:
        return []
    shapes = list(dict.fromkeys(curve.shape for curve in curves))
    columns = list(dict.fromkeys(curve.column for curve in curves))
    looks = style.looks(list(dict.fromkeys(curve.label for curve in curves)))
    with style.sheet(
        out, name, _PANEL, len(shapes), len(columns), sharex="all", sharey="row"
    ) as sheet:
        for row, shape in enumerate(shapes):
            for i, column in enumerate(columns):
                here = [each for each in curves if (each.shape, each.column) == (shape, column)]
                axes = sheet.panel(row, i)
                for curve in here:
                    _draw_curve(axes, curve, looks[curve.label])
                axes.set_title(f"{shape} {column}")
                if row == len(shapes) - 1:
                    axes.set_xlabel(x_axis[0])
            sheet.panel(row).set_ylabel(style.SPEED)
            sheet.panel(row).set_ylim(bottom=min(0.0, sheet.panel(row).get_ylim()[0]))
        handles = [
            Line2D([], [], color=look.color, ls=look.line, label=label)
            for label, look in looks.items()
        ]
        if reference:
            handles.append(Line2D([], [], **_REFERENCE, label=reference))
        if len(handles) > 1:
            sheet.legend(handles)
        numbers = [len(curve.values) for curve in curves]
        of_band = "; line: median, band: quartiles over runs" if max(numbers) > 1 else ""
        sheet.note(style.counted(numbers) + of_band)
    return [
        *sheet.files,
        *tables.write(_rows(curves, x_axis[1], points), out, name, caption),
    ]


def _draw_curve(axes: Axes, curve: Curve, look: style.Look) -> None:
    middle, (low, high) = curve.median, curve.quartiles
    axes.plot(curve.x, middle, color=look.color, ls=look.line)
    if curve.reference is not None:
        axes.axhline(curve.reference, **_REFERENCE)
    if len(curve.values) > 1:
        axes.fill_between(curve.x, low, high, color=look.color, alpha=0.25, lw=0)


def _rows(curves: Sequence[Curve], x_name: str, points: int) -> list[dict[str, Any]]:
    rows = []
    for curve in curves:
        n_points = min(len(curve.x), points)
        chosen = np.unique(np.linspace(0, len(curve.x) - 1, n_points).round().astype(int))
        middle, deviation = curve.median, curve.deviation
        low, high = curve.quartiles
        rows += [
            {
                "where": f"{curve.shape} {curve.column}",
                "controller": curve.label,
                x_name: float(curve.x[i]),
                "n": int((~np.isnan(curve.values[:, i])).sum()),
                "median": float(middle[i]),
                "q25": float(low[i]),
                "q75": float(high[i]),
                "deviation": float(deviation[i]),
            }
            for i in chosen
        ]
    return rows
