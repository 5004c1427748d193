"""Draws recorded and own data over each other."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.validate.case import Panel, Picture

matplotlib.use("Agg")

__all__ = ["draw"]

_RECORDED, _OURS = "#e07b00", "#1f5fa8"
_PANEL = (5.0, 3.8)  # size [inch]


def draw(pictures: Sequence[Picture], folder: Path) -> list[Path]:
    """Writes every picture as a PNG file into an existing folder; returns their paths."""
    return [_draw_one(picture, folder) for picture in pictures]


def _draw_one(picture: Picture, folder: Path) -> Path:
    columns = min(len(picture.panels), 2)
    rows = -(-len(picture.panels) // columns)
    width, height = _PANEL
    figure = Figure(figsize=(width * columns, height * rows), layout="constrained")
    figure.suptitle(picture.name)
    grid = figure.subplots(rows, columns, squeeze=False).flatten()
    for axes, panel in zip(grid, picture.panels, strict=False):
        _KINDS[panel.kind](axes, panel)
        axes.set_title(panel.title, fontsize="medium")
        axes.set_xlabel(panel.x_label)
        axes.set_ylabel(panel.y_label)
        axes.grid(alpha=0.3)
        axes.legend(loc="best", fontsize="small")
    for axes in grid[len(picture.panels) :]:
        axes.set_axis_off()
    path = folder / f"{picture.name}.png"
    figure.savefig(path, dpi=120)
    return path


def _lines(axes: Axes, panel: Panel) -> None:
    curves = zip(panel.recorded.T, panel.ours.T, strict=True)
    for index, (recorded, ours) in enumerate(curves):
        label = ("recorded", "ours") if index == 0 else (None, None)
        axes.plot(panel.x, recorded, color=_RECORDED, linewidth=3, alpha=0.5, label=label[0])
        axes.plot(panel.x, ours, color=_OURS, linewidth=0.9, label=label[1])


def _points(axes: Axes, panel: Panel) -> None:
    both = np.concatenate([panel.recorded, panel.ours])
    ends = [float(np.nanmin(both)), float(np.nanmax(both))]
    axes.plot(ends, ends, color=_RECORDED, linewidth=1, label="equal")
    axes.scatter(panel.recorded, panel.ours, s=12, color=_OURS, alpha=0.7, label="one robot")


def _share(axes: Axes, panel: Panel) -> None:
    axes.ecdf(panel.recorded, color=_RECORDED, linewidth=3, alpha=0.5, label="recorded")
    axes.ecdf(panel.ours[np.isfinite(panel.ours)], color=_OURS, linewidth=0.9, label="ours")


_KINDS = {"lines": _lines, "points": _points, "share": _share}
