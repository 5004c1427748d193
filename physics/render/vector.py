"""A canvas of vectors, written as SVG or PDF."""

from __future__ import annotations

import io
from collections.abc import Iterator
from itertools import count
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle

from physics.render.canvas import Text
from physics.render.palette import Color

__all__ = ["Vectors"]

_DPI = 72  # so that a pixel is a point
_ABOVE_ALL = 1e9
_FONT = 0.86  # DejaVu Sans is wider than the font of pictures in pixels
_HORIZONTAL = {"l": "left", "m": "center", "r": "right"}
_VERTICAL = {"t": "top", "m": "center", "b": "bottom"}
_BACKING = {"facecolor": "white", "alpha": 0.78, "edgecolor": "none", "pad": 1.5}
_RC: dict[Any, Any] = {"svg.fonttype": "none", "pdf.fonttype": 42, "svg.hashsalt": "hebbtorch"}


class Vectors:
    """A canvas (see `canvas.Canvas`) of shapes that stay sharp at any size."""

    def __init__(self, size: tuple[int, int], background: Color) -> None:
        figure = Figure(figsize=(size[0] / _DPI, size[1] / _DPI), dpi=_DPI)
        axes = figure.add_axes((0, 0, 1, 1))
        axes.set(xlim=(0, size[0]), ylim=(size[1], 0))
        axes.set_axis_off()
        self._begin(figure, count(), size, np.zeros(2), background)

    def _begin(
        self,
        figure: Figure,
        order: Iterator[int],
        size: tuple[int, int],
        offset: np.ndarray,
        background: Color,
    ) -> None:
        self.size = size
        self._figure, self._axes = figure, figure.axes[0]
        self._order = order  # what is drawn later lies above
        self._offset = offset
        left, top = offset.tolist()
        self._clip = Rectangle((left, top), *size, facecolor=_rgb(background), linewidth=0)
        self._clip.set_zorder(next(order))
        self._axes.add_patch(self._clip)

    def polygon(self, points: np.ndarray, fill: Color) -> None:
        """See `canvas.Canvas`."""
        shape = Polygon(points + self._offset, closed=True, facecolor=_rgb(fill), linewidth=0)
        shape.set_zorder(next(self._order))
        self._axes.add_patch(shape)
        shape.set_clip_path(self._clip)

    def line(self, points: np.ndarray, color: Color, width: float) -> None:
        """See `canvas.Canvas`."""
        moved = points + self._offset
        (line,) = self._axes.plot(
            moved[:, 0], moved[:, 1], color=_rgb(color), linewidth=width, scalex=False, scaley=False
        )
        line.set_zorder(next(self._order))
        line.set_clip_path(self._clip)

    def text(self, text: Text) -> None:
        """See `canvas.Canvas`."""
        x, y = np.add(text.position, self._offset)
        self._axes.text(
            x,
            y,
            text.words,
            fontsize=_FONT * text.size,
            color=_rgb(text.color),
            ha=_HORIZONTAL[text.anchor[0]],
            va=_VERTICAL[text.anchor[1]],
            bbox=_BACKING if text.backed and text.words else None,
            parse_math=False,
            zorder=_ABOVE_ALL,
        )

    def inset(self, left: int, top: int, size: tuple[int, int], background: Color) -> Vectors:
        """See `canvas.Canvas`."""
        inset = object.__new__(Vectors)
        inset._begin(
            self._figure, self._order, size, self._offset + np.array([left, top]), background
        )
        return inset

    def finish(self, suffix: str) -> bytes:
        """The content of a file, ".svg" or ".pdf"; the same every time."""
        content = io.BytesIO()
        date = {"CreationDate": None} if suffix == ".pdf" else {"Date": None}
        with mpl.rc_context(_RC):
            self._figure.savefig(content, format=suffix[1:], metadata=date)
        return content.getvalue()


def _rgb(color: Color) -> tuple[float, float, float]:
    red, green, blue = (channel / 255 for channel in color)
    return red, green, blue
