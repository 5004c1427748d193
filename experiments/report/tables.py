"""Tables of results, each as CSV (every digit) and as Markdown (to read)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from experiments.io.atomic import write_atomically
from experiments.io.csvfile import write_csv
from experiments.report.statistics import Comparison

__all__ = ["comparison_row", "markdown", "write"]

TableRow = Mapping[str, Any]


def write(rows: Sequence[TableRow], out: Path, name: str, caption: str = "") -> list[Path]:
    """Write `out/name.csv` and `out/name.md`, in place of those that may be there.

    Args:
        rows: one mapping of column and value each; a column that a row lacks stays empty.
        out: an existing folder.
        name: The name of both files.
        caption: what the table says, above it in the Markdown file.

    Returns:
        The two files.
    """
    columns = _columns(rows)
    cells = ([row.get(column, "") for column in columns] for row in rows)
    as_csv = write_csv(out / f"{name}.csv", columns, cells)
    as_markdown = out / f"{name}.md"
    title = f"# {name}\n\n" + (f"{caption}\n\n" if caption else "")
    write_atomically(as_markdown, f"{title}{markdown(rows)}".encode())
    return [as_csv, as_markdown]


def markdown(rows: Sequence[TableRow]) -> str:
    """The rows as a Markdown table, numbers with three significant digits."""
    columns = _columns(rows)
    lines = [columns, ["---"] * len(columns)]
    lines += [[_short(row.get(column, "")) for column in columns] for row in rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def comparison_row(comparison: Comparison) -> dict[str, Any]:
    """The columns of a comparison; medians in the unit of what was compared."""
    row: dict[str, Any] = {"where": comparison.where}
    for side, name, n, middle in zip(
        ("first", "second"),
        (comparison.first, comparison.second),
        comparison.n,
        comparison.medians,
        strict=True,
    ):
        row |= {
            side: name,
            f"n_{side}": n,
            f"median_{side}": middle.value,
            f"low_{side}": middle.low,
            f"high_{side}": middle.high,
        }
    return row | {
        "a12": comparison.a12,
        "p": comparison.p,
        "p_holm": comparison.p_holm,
        "least_p_holm": comparison.least_p_holm,
        "verdict": comparison.verdict,
    }


def _columns(rows: Sequence[TableRow]) -> list[str]:
    """All columns, in the order of their first appearance."""
    return list(dict.fromkeys(column for row in rows for column in row))


def _short(value: Any) -> str:
    if isinstance(value, float):
        return "n/a" if math.isnan(value) else f"{value:.3g}"
    return str(value).replace("|", "\\|").replace("\n", " ")
