"""Box plots of controllers side by side, for each shape (rows) and apparatus (groups)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch
from numpy.typing import NDArray

from experiments.io import style
from experiments.report import intervals, statistics, tables
from experiments.report.statistics import Comparison, Pair

__all__ = ["Box", "compare_with", "draw", "write_table"]

Values = NDArray[np.float64]

_FEW = 12  # up to so many values are drawn as points, too
_LEAST = 5  # fewer make no box: its quartiles would be the points themselves
_MAIN = "Hebbian"  # label of the paper's main model
_STATIC = ("MLP", "RNN")  # how labels of static networks begin
_WIDTH = 0.8  # of a group of boxes; groups are 1 apart
_ROW_HEIGHT = 2.3  # [in]


@dataclass(frozen=True)
class Box:
    """One box.

    Attributes:
        shape: The body and sensors, which make the row.
        sensors: the group within the row.
        label: The name of the controller.
        values: one number per independent run [m/s]: what is tested.
        pooled: what is drawn, if that is more: every terrain of every run [m/s].
        more: further numbers of the controller for the table, by name.
    """

    shape: str
    sensors: str
    label: str
    values: Values
    pooled: Values | None = None
    more: Mapping[str, float] = field(default_factory=dict)

    @property
    def where(self) -> str:
        """Shape and apparatus."""
        return f"{self.shape} {self.sensors}"

    @property
    def drawn(self) -> Values:
        """What the box shows: the episodes that did not fail."""
        values = self.values if self.pooled is None else self.pooled
        return values[np.isfinite(values)]


def compare_with(boxes: Sequence[Box], reference: str) -> list[Comparison]:
    """Every controller against the one of reference, where both are there; one family."""
    by_place = {(box.where, box.label): box for box in boxes}
    return statistics.compare(
        [
            Pair(box.label, reference, box.values, other.values, box.where)
            for box in boxes
            if box.label != reference and (other := by_place.get((box.where, reference)))
        ]
    )


def draw(
    boxes: Sequence[Box], out: Path, name: str, reference: str, caption: str = ""
) -> list[Path]:
    """Draw boxes, with p above those that have a counterpart, and write the table.

    Args:
        boxes: The boxes in the order of drawing; labels follow in the order of their first
            appearance.
        out: an existing folder.
        name: The name of the files.
        reference: the label that others are compared with.
        caption: The caption of the table.

    Returns:
        The files; none if there are no boxes.
    """
    if not boxes:
        return []
    comparisons = compare_with(boxes, reference)
    main = _name(reference, [box.label for box in boxes])
    shapes = list(dict.fromkeys(box.shape for box in boxes))
    labels = list(dict.fromkeys(box.label for box in boxes))
    n_groups = max(len({box.sensors for box in boxes if box.shape == each}) for each in shapes)
    width = min(max(0.42 * n_groups * len(labels), 2.6), 6.6)
    with style.sheet(out, name, (width, _ROW_HEIGHT), rows=len(shapes)) as sheet:
        for row, shape in enumerate(shapes):
            here = [box for box in boxes if box.shape == shape]
            _draw_shape(sheet.panel(row), here, labels, comparisons, main)
        sheet.legend(
            [
                Patch(
                    facecolor=look.color,
                    edgecolor="black",
                    hatch=look.hatch,
                    label=main if label == reference else label,
                )
                for label, look in style.looks(labels).items()
            ]
        )
        sheet.note(_note(boxes))
    return [*sheet.files, *write_table(boxes, comparisons, reference, out, name, caption)]


def write_table(
    boxes: Sequence[Box],
    comparisons: Sequence[Comparison],
    reference: str,
    out: Path,
    name: str,
    caption: str,
) -> list[Path]:
    """Write the table of boxes alone, with what `compare_with` gave."""
    return tables.write(_rows(boxes, comparisons, reference), out, name, caption)


def _draw_shape(
    axes: Axes,
    boxes: Sequence[Box],
    labels: Sequence[str],
    comparisons: Sequence[Comparison],
    main: str,
) -> None:
    groups = list(dict.fromkeys(box.sensors for box in boxes))
    slot = _WIDTH / len(labels)
    places = {
        (sensors, label): group + (i - (len(labels) - 1) / 2) * slot
        for group, sensors in enumerate(groups)
        for i, label in enumerate(labels)
    }
    looks = style.looks(labels)
    for box in boxes:
        _draw_box(axes, places[box.sensors, box.label], slot, box.drawn, looks[box.label])
    axes.set_xticks(range(len(groups)), [f"{sensors}" for sensors in groups])
    axes.set_xlim(-0.5, len(groups) - 0.5)
    axes.set(ylabel=style.SPEED, xlabel="sensory apparatus")
    if len(labels) > 2:
        axes.set_title(boxes[0].shape, loc="left")
        if comparisons:
            words = f"(top: p against {main}, in brackets after Holm's correction)"
            axes.set_title(words, loc="right", fontsize=6)
    else:
        axes.set_title(boxes[0].shape)
    low, high = axes.get_ylim()
    axes.set_ylim(min(low, 0.0), high + 0.22 * (high - min(low, 0.0)))  # room for p
    found = {(each.where, each.first): each for each in comparisons}
    for box in boxes:
        if comparison := found.get((box.where, box.label)):
            ends = (places[box.sensors, box.label], places[box.sensors, comparison.second])
            _write_p(axes, ends, comparison, bracket=len(labels) == 2)


def _draw_box(axes: Axes, x: float, slot: float, values: Values, look: style.Look) -> None:
    if not len(values):
        axes.text(x, 0, "failed", rotation=90, ha="center", va="bottom", fontsize=6)
        return
    if len(values) >= _LEAST:
        _draw_quartiles(axes, x, slot, values, look)
    else:
        middle = float(np.median(values))
        axes.plot((x - 0.3 * slot, x + 0.3 * slot), (middle, middle), color=look.color, lw=2)
    if len(values) <= _FEW:
        spread = np.linspace(-0.15, 0.15, len(values)) * slot
        axes.plot(x + spread, values, "o", color="white", mec="black", ms=2.6, mew=0.6, zorder=3)


def _draw_quartiles(axes: Axes, x: float, slot: float, values: Values, look: style.Look) -> None:
    drawn = axes.boxplot(
        [values],
        positions=[x],
        widths=0.75 * slot,
        patch_artist=True,
        manage_ticks=False,
        showfliers=len(values) > _FEW,
        flierprops={"markersize": 2},
        medianprops={"color": "black", "linewidth": 1.4},
    )
    for patch in drawn["boxes"]:
        patch.set(facecolor=look.color, hatch=look.hatch, alpha=0.85)


def _write_p(
    axes: Axes, ends: tuple[float, float], comparison: Comparison, *, bracket: bool
) -> None:
    """The p of a pair above it, alone and after Holm's correction; of one of many against the
    reference, above the one."""
    top = axes.get_xaxis_transform()
    text = _p(comparison.p)
    if comparison.p_holm != comparison.p:
        text += f"\n(Holm {_p(comparison.p_holm)})" if bracket else f"\n({_p(comparison.p_holm)})"
    if bracket:
        axes.plot(ends, (0.87, 0.87), transform=top, color="black", lw=0.7)
    x = sum(ends) / 2 if bracket else ends[0]
    text = text if bracket else text.replace("p = ", "").replace("p < ", "<")
    axes.text(x, 0.88, text, transform=top, ha="center", va="bottom", fontsize=6, linespacing=1)


def _name(reference: str, labels: Sequence[str]) -> str:
    """What the controller of reference is called: the main model, among variants of it, "full"."""
    among_variants = not any(label.startswith(_STATIC) for label in labels)
    return "full" if reference == _MAIN and among_variants else reference


def _p(p: float) -> str:
    return "p < 0.001" if p < 0.001 else f"p = {p:.{2 if p >= 0.01 else 1}g}"


def _note(boxes: Sequence[Box]) -> str:
    """How many runs, and what is drawn."""
    words = [style.counted([len(box.values) for box in boxes])]
    if any(box.pooled is not None for box in boxes):
        words.append("values: runs x terrains")
    sizes = [len(box.drawn) for box in boxes]
    if max(sizes) >= _LEAST:
        words.append("box: median and quartiles, whiskers: within 1.5 times their distance")
    if min(sizes) < _LEAST:
        words.append("of fewer than five the median, a line, and all points")
    return "; ".join(words)


def _rows(
    boxes: Sequence[Box], comparisons: Sequence[Comparison], reference: str
) -> list[dict[str, Any]]:
    by_place = {(box.where, box.label): box for box in boxes}
    rows = []
    for comparison in comparisons:
        row = tables.comparison_row(comparison)
        pair = [by_place[comparison.where, each] for each in (comparison.first, reference)]
        shift = intervals.shift(*(box.values for box in pair))
        row |= {"shift": shift.value, "shift_low": shift.low, "shift_high": shift.high}
        pooled = [box.pooled for box in pair if box.pooled is not None]
        if len(pooled) == 2:
            row["p_pooled"] = statistics.mann_whitney(*pooled).p
        for side, each in zip(("first", "second"), pair, strict=True):
            row |= {f"{name}_{side}": value for name, value in each.more.items()}
        rows.append(row)
    compared = {(row["where"], row[side]) for row in rows for side in ("first", "second")}
    for box in boxes:
        if (box.where, box.label) not in compared:
            rows.append({"where": box.where, "first": box.label, **_alone(box)})
    return rows


def _alone(box: Box) -> dict[str, Any]:
    """The columns of a box that has nothing to be compared with."""
    middle = intervals.median(box.values)
    return {
        "n_first": len(box.values),
        "median_first": middle.value,
        "low_first": middle.low,
        "high_first": middle.high,
        **{f"{name}_first": value for name, value in box.more.items()},
    }
