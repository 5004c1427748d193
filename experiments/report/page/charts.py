"""Curves of a page, as its scripts draw them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

__all__ = ["band", "chart", "curve"]

_BAND = "rgba(0, 114, 178, 0.18)"


def curve(label: str, values: np.ndarray, *, points: bool = False) -> dict[str, Any]:
    """One curve; what is not a number is a gap.

    Args:
        label: The name in the legend.
        values: The heights of the curve, shape (X,).
        points: whether to mark every value.
    """
    rounded = [round(value, 4) if math.isfinite(value) else None for value in values.tolist()]
    return {"label": label, "y": rounded, "points": points}


def chart(
    x: np.ndarray, curves: Sequence[dict[str, Any]], x_label: str, y_label: str
) -> dict[str, Any]:
    """A chart of curves over the same x, shape (X,), ascending."""
    return {"x": x.tolist(), "curves": list(curves), "x_label": x_label, "y_label": y_label}


def band(
    x: np.ndarray, table: np.ndarray, label: str, x_label: str, y_label: str
) -> dict[str, Any]:
    """A chart of the median of several runs within their quartiles.

    Args:
        x: The abscissas, shape (X,).
        table: shape (runs, X), NaN where a run has no value.
        label: The label of what is drawn.
        x_label: The label of the horizontal axis.
        y_label: The label of the vertical axis.
    """
    known = ~np.isnan(table).all(axis=0)
    low, middle, high = np.full((3, len(x)), np.nan)
    if known.any():
        low[known], middle[known], high[known] = np.nanquantile(
            table[:, known], (0.25, 0.5, 0.75), axis=0
        )
    n = len(table)
    curves = [
        curve(f"{label}, median of {n} runs", middle),
        {**curve("upper quartile", high), "hidden": True},
        {**curve("lower quartile", low), "hidden": True},
    ]
    return {**chart(x, curves, x_label, y_label), "bands": [[1, 2, _BAND]]}
