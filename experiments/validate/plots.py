"""Draws recorded and own data over each other, in the style of all figures, with what differs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from experiments.io import style
from experiments.validate.case import Panel, Picture

__all__ = ["draw"]

_RECORDED, _OURS = "#E69F00", "#0072B2"
_PANEL = (3.2, 2.3)  # [in]
_RESIDUAL = 1.1  # height of the panels of what differs [in]


def draw(pictures: Sequence[Picture], folder: Path) -> list[Path]:
    """Writes every picture as PNG and PDF into an existing folder; returns their paths."""
    return [path for picture in pictures for path in _draw_one(picture, folder)]


def _draw_one(picture: Picture, folder: Path) -> list[Path]:
    """The panels from left to right, and below them, where they say it, ours less recorded."""
    panels = picture.panels
    rows = 2 if any(panel.kind != "share" for panel in panels) else 1
    height = _PANEL[1] if rows == 1 else (_PANEL[1] + _RESIDUAL) / 2
    with style.sheet(
        folder, picture.name, (_PANEL[0], height), rows, len(panels), heights=_heights(rows)
    ) as sheet:
        for k, panel in enumerate(panels):
            axes = sheet.panel(0, k)
            _KINDS[panel.kind](axes, panel)
            axes.set(title=panel.title, xlabel=panel.x_label, ylabel=panel.y_label)
            if rows == 2:
                _draw_residual(sheet.panel(1, k), panel)
        sheet.legend(
            [
                Line2D(
                    [], [], color=_RECORDED, lw=3, alpha=0.6, label="recorded (paper's simulator)"
                ),
                Line2D([], [], color=_OURS, lw=1, label="ours"),
            ],
            title=picture.name.replace("_", " "),
        )
    return sheet.files


def _heights(rows: int) -> list[float]:
    return [_PANEL[1], _RESIDUAL][:rows]


def _draw_residual(axes: Axes, panel: Panel) -> None:
    """Ours less recorded; nothing of distributions, whose robots are no pairs."""
    if panel.kind == "share":
        axes.set_visible(False)
        return
    axes.axhline(0, color=_RECORDED, lw=1.5, alpha=0.6)
    difference = panel.ours - panel.recorded
    if panel.kind == "lines":
        axes.plot(panel.x, difference, color=_OURS, lw=0.8)
        axes.set_xlabel(panel.x_label)
    else:
        axes.scatter(panel.recorded, difference, s=8, color=_OURS, alpha=0.7)
        axes.set_xlabel(panel.x_label)
    axes.set_ylabel("ours - recorded")


def _lines(axes: Axes, panel: Panel) -> None:
    axes.plot(panel.x, panel.recorded, color=_RECORDED, lw=3, alpha=0.6)
    axes.plot(panel.x, panel.ours, color=_OURS, lw=0.9)


def _points(axes: Axes, panel: Panel) -> None:
    both = np.concatenate([panel.recorded, panel.ours])
    ends = [float(np.nanmin(both)), float(np.nanmax(both))]
    axes.plot(ends, ends, color=_RECORDED, lw=1.5, alpha=0.6)
    axes.scatter(panel.recorded, panel.ours, s=10, color=_OURS, alpha=0.7)


def _share(axes: Axes, panel: Panel) -> None:
    axes.ecdf(panel.recorded, color=_RECORDED, lw=3, alpha=0.6)
    axes.ecdf(panel.ours[np.isfinite(panel.ours)], color=_OURS, lw=0.9)


_KINDS = {"lines": _lines, "points": _points, "share": _share}
