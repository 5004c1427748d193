"""Shows and writes what a validation found."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from experiments.validate.case import Check, SelfAgreement, Setting, Skip

__all__ = ["show_rows", "show_self_agreements", "verdict", "write_json"]

_FORMAT = 1  # of the table in JSON
_COLOURS = {"pass": "green", "FAIL": "bold red", "skipped": "yellow"}


def verdict(row: Check | Skip) -> str:
    """One word: pass, FAIL or skipped."""
    if isinstance(row, Skip):
        return "skipped"
    return "pass" if row.passes else "FAIL"


def show_rows(console: Console, rows: Sequence[Check | Skip]) -> None:
    """Prints the table of all figures."""
    table = Table(title="Recorded runs and ours", title_justify="left")
    table.add_column("case", overflow="fold")
    table.add_column("measure")
    for name in ("reference", "ours", "tolerance", "its own shift"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    before = None
    for row in rows:
        if before not in (None, row.case):
            table.add_section()
        shown = row.case if row.case != before else ""
        before = row.case
        word = verdict(row)
        coloured = f"[{_COLOURS[word]}]{word}[/]"
        if isinstance(row, Skip):
            table.add_row(shown, escape(row.why), "", "", "", "", coloured)
            continue
        figures = (_number(row.reference), _number(row.ours), str(row.tolerance))
        table.add_row(shown, escape(row.measure), *figures, _number(row.itself), coloured)
    console.print(table)
    console.print("its own shift: the reference against itself, from a start shifted by 1e-6 m")


def show_self_agreements(console: Console, self_agreements: Sequence[SelfAgreement]) -> None:
    """Prints how far the speeds of random gaits agree with those of the reference at all."""
    if not self_agreements:
        return
    table = Table(
        title="Agreement with the reference's plain runs (Spearman, mean absolute "
        "difference, bias in m/s)",
        title_justify="left",
    )
    table.add_column("case", no_wrap=True)
    table.add_column("mean speed", justify="right")
    for name in (
        "reference, shifted by 1e-6 m",
        "reference, no continuous detection",
        "ours, one start",
    ):
        table.add_column(name, justify="right")
    for y in self_agreements:
        figures = (_agreement(y.shifted), _agreement(y.no_detection), _agreement(y.ours))
        table.add_row(y.case, f"{y.mean:.3f}", *figures)
    console.print(table)


def write_json(
    path: Path,
    folder: Path,
    setting: Setting,
    rows: Sequence[Check | Skip],
    self_agreements: Sequence[SelfAgreement],
) -> None:
    """Writes everything for a machine to read. What is not a finite number becomes null."""
    content = {
        "format": _FORMAT,
        "reference": str(folder),
        "seed": setting.seed,
        "device": setting.device,
        "passed": all(isinstance(row, Skip) or row.passes for row in rows),
        "cases": [_entry(row) for row in rows],
        "self_agreement": [
            {
                "case": y.case,
                "mean_speed": y.mean,
                **{
                    name: _named(agreement)
                    for name, agreement in (
                        ("shifted_start", y.shifted),
                        ("no_continuous_detection", y.no_detection),
                        ("ours", y.ours),
                    )
                },
            }
            for y in self_agreements
        ],
    }
    path.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def _entry(row: Check | Skip) -> dict[str, Any]:
    if isinstance(row, Skip):
        return {"case": row.case, "measure": row.why, "verdict": verdict(row)}
    return {
        "case": row.case,
        "measure": row.measure,
        "reference": _finite(row.reference),
        "ours": _finite(row.ours),
        "tolerance": str(row.tolerance),
        "its_own_shift": _finite(row.itself),
        "verdict": verdict(row).lower(),
    }


def _named(agreement: tuple[float, float, float] | None) -> dict[str, float | None] | None:
    if agreement is None:
        return None
    names = ("spearman", "mean_absolute_difference", "bias")
    return {name: _finite(figure) for name, figure in zip(names, agreement, strict=True)}


def _finite(figure: float | None) -> float | None:
    return float(figure) if figure is not None and math.isfinite(figure) else None


def _number(figure: float | None) -> str:
    return "" if figure is None else f"{figure:.4g}" if abs(figure) >= 1e-3 else f"{figure:.2g}"


def _agreement(agreement: tuple[float, float, float] | None) -> str:
    if agreement is None:
        return "not recorded"
    correlation, difference, bias = agreement
    return f"{correlation:.3f}, {difference:.3f}, {bias:+.3f}"
