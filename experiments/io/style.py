"""How all figures look: sizes for print, colours for every eye, and readable without colour."""

from __future__ import annotations

import dataclasses
import io
import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from experiments.io.atomic import write_atomically

__all__ = ["SPEED", "Look", "Sheet", "counted", "looks", "sheet"]

SPEED = "velocity $\\bar{v}_x$ [m/s]"

_DPI = 200
_LEGEND_ROWS, _LEGEND_ROW = 3, 0.17  # for which there is room; height of one more [in]
_LEGEND_HANDLE, _LEGEND_LETTER = 0.55, 0.062  # widths in a legend [in]
_NOTE_LETTER = 0.05  # width of a letter of a note [in]
_RC: dict[Any, Any] = {
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "lines.linewidth": 1.2,
    "hatch.linewidth": 0.5,
    "pdf.fonttype": 42,
    "figure.dpi": _DPI,
}


@dataclass(frozen=True)
class Look:
    """What tells a controller from others: colour, line style (curves), hatch (boxes), marker."""

    color: str
    line: Any
    hatch: str
    marker: str


# Okabe and Ito's colours, which differ for every kind of colour vision, in grey too by the rest.
_LOOKS = (
    Look("#0072B2", "-", "", "o"),
    Look("#E69F00", (0, (4, 1.5)), "////", "s"),
    Look("#009E73", (0, (1, 1)), "....", "D"),
    Look("#CC79A7", (0, (5, 1, 1, 1)), "xxxx", "^"),
    Look("#D55E00", (0, (8, 2)), "----", "v"),
    Look("#56B4E9", (0, (3, 1, 1, 1, 1, 1)), "++++", "P"),
)


def looks(labels: Sequence[str]) -> dict[str, Look]:
    """A look for each label, in order; the first is that of the main model. Where there are more
    labels than colours, these come again with other lines, hatches and markers."""
    found = {}
    for i, label in enumerate(labels):
        again, place = divmod(i, len(_LOOKS))
        other = _LOOKS[(place + again) % len(_LOOKS)]
        found[label] = dataclasses.replace(other, color=_LOOKS[place].color)
    return found


def counted(numbers: Sequence[int]) -> str:
    """How many runs there are, such as "n = 10 runs" or "n = 3 to 10 runs"."""
    low, high = min(numbers), max(numbers)
    words = str(low) if low == high else f"{low} to {high}"
    return f"n = {words} run{'' if high == 1 else 's'}"


@dataclass
class Sheet:
    """A figure in the making.

    Attributes:
        figure: all of it.
        axes: its panels, shape (rows, columns).
        files: what was written, once the sheet is done.
    """

    figure: Figure
    axes: NDArray[Any]
    files: list[Path]

    def legend(self, handles: Sequence[Any], title: str = "") -> None:
        """One legend for all panels, above them, under a title."""
        longest = max(len(handle.get_label()) for handle in handles)
        column = _LEGEND_HANDLE + _LEGEND_LETTER * longest
        columns = max(1, min(len(handles), int(self.figure.get_figwidth() / column)))
        rows = -(-len(handles) // columns)
        more = _LEGEND_ROW * max(0, rows - _LEGEND_ROWS)  # so that it does not take it from panels
        self.figure.set_figheight(self.figure.get_figheight() + more)
        self.figure.legend(
            handles=handles, loc="outside upper center", ncols=columns, title=title or None
        )

    def note(self, words: str) -> None:
        """Say below all panels what they show: how many runs, and what boxes and bands are."""
        width = int(self.figure.get_figwidth() / _NOTE_LETTER)
        self.figure.supxlabel(textwrap.fill(words, width), fontsize=6, color="0.3")

    def panel(self, row: int, column: int = 0) -> Axes:
        """One of the panels."""
        axes: Axes = self.axes[row, column]
        return axes


@contextmanager
def sheet(
    out: Path,
    name: str,
    size: tuple[float, float],
    rows: int = 1,
    columns: int = 1,
    heights: Sequence[float] | None = None,
    **share: str,
) -> Iterator[Sheet]:
    """Draw within this context; at its end `out/name.png` and `out/name.pdf` are written.

    Args:
        out: an existing folder.
        name: The name of the files.
        size: width and height of one panel [in].
        rows: The number of rows of panels.
        columns: The number of columns of panels.
        heights: The heights of the rows in relation to each other; the same for all if not given.
        share: `sharex` and `sharey` of matplotlib's `subplots`.
    """
    with mpl.rc_context(_RC):
        figure = Figure(
            figsize=(columns * size[0] + 0.6, rows * size[1] + 0.5), layout="constrained"
        )
        axes = figure.subplots(rows, columns, squeeze=False, height_ratios=heights, **share)  # type: ignore[call-overload]
        drawn = Sheet(figure, np.asarray(axes), [])
        yield drawn
        if (engine := figure.get_layout_engine()) is not None:
            engine.execute(figure)
        figure.set_layout_engine("none")  # laid out once is enough for both files
        for suffix in (".png", ".pdf"):
            drawn.files.append(_save(figure, out / f"{name}{suffix}"))


def _save(figure: Figure, path: Path) -> Path:
    content = io.BytesIO()
    # Without a date, the same results give the same file.
    metadata = {"CreationDate": None} if path.suffix == ".pdf" else None
    figure.savefig(content, format=path.suffix[1:], dpi=_DPI, metadata=metadata)
    write_atomically(path, _few_colors(content) if path.suffix == ".png" else content.getvalue())
    return path


def _few_colors(png: io.BytesIO) -> bytes:
    """A third of the bytes: figures have few colours, and the eye tells no difference."""
    content = io.BytesIO()
    with Image.open(png) as image:
        palette = image.convert("RGB").quantize(256, dither=Image.Dither.NONE)
    palette.save(content, "png", optimize=True, dpi=(_DPI, _DPI))
    return content.getvalue()
