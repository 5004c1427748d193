"""Shows and writes the table."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from experiments.bench.machine import Machine
from experiments.bench.measurement import Measurement, Stage

__all__ = ["markdown", "show_rows", "show_stages", "write_json"]

_FORMAT = 1  # of the table in JSON
_COLOURS = {"aim": "green", "reached": "yellow", "MISSED": "bold red"}
_COLUMNS = (
    "what",
    "unit",
    "median",
    "best",
    "quartiles",
    "n",
    "baseline",
    "ratio",
    "target / aim",
    "verdict",
    "others",
)
_SHOWN = ("median", "best", "unit", "baseline", "ratio", "target / aim", "verdict", "others")


def show_rows(console: Console, rows: Sequence[Measurement]) -> None:
    """Prints the table."""
    table = Table(title="Speed", title_justify="left")
    table.add_column("what", overflow="fold")
    for name in _SHOWN:
        table.add_column(name, justify="right", no_wrap=True)
    for row in rows:
        cells = dict(zip(_COLUMNS, _cells(row), strict=True))
        if row.verdict:
            cells["verdict"] = f"[{_COLOURS[row.verdict]}]{row.verdict}[/]"
        table.add_row(escape(row.what), *(cells[name] for name in _SHOWN))
    console.print(table)
    console.print("others: cores that other processes took meanwhile; they slow everything down")


def show_stages(console: Console, stages: Sequence[Stage]) -> None:
    """Prints where the time goes."""
    table = Table(title="Where a robot-step's time goes", title_justify="left")
    table.add_column("stage")
    table.add_column("us", justify="right")
    table.add_column("share", justify="right")
    for name, *cells in _stage_cells(stages):
        table.add_row(name, *cells)
    console.print(table)


def markdown(machine: Machine, rows: Sequence[Measurement], stages: Sequence[Stage]) -> str:
    """The tables as Markdown."""
    lines = [f"{machine.cpu}, {machine.cores} cores, python {machine.python}, "]
    lines[0] += f"torch {machine.torch}, taichi {machine.taichi}; `{machine.command}`, "
    lines[0] += machine.date
    lines += ["", _line(_COLUMNS), _line(("---",) * 2 + ("--:",) * (len(_COLUMNS) - 2))]
    lines += [_line(_cells(row)) for row in rows]
    if stages:
        lines += ["", _line(("stage", "us per robot-step", "share")), _line(("---", "--:", "--:"))]
        lines += [_line(cells) for cells in _stage_cells(stages)]
    return "\n".join(lines) + "\n"


def write_json(
    path: Path,
    machine: Machine,
    seed: int,
    quick: bool,
    rows: Sequence[Measurement],
    stages: Sequence[Stage],
) -> None:
    """Writes everything for a machine to read."""
    content = {
        "format": _FORMAT,
        "machine": machine.as_dict(),
        "seed": seed,
        "quick": quick,
        "rows": [_entry(row) for row in rows],
        "profile": [{"stage": s.name, "microseconds": s.microseconds} for s in stages],
    }
    path.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def _entry(row: Measurement) -> dict[str, Any]:
    target = row.target and {"bound": row.target.bound, "aim": row.target.aim}
    return {
        "what": row.what,
        "value": row.median,
        "unit": row.unit,
        "more_is_better": row.more_is_better,
        "repetitions": len(row.samples),
        "median": row.median,
        "best": row.best,
        "quartiles": list(row.quartiles),
        "baseline": row.baseline,
        "ratio": row.ratio,
        "target": target,
        "verdict": row.verdict and row.verdict.lower(),
        "others": row.others,
    }


def _cells(row: Measurement) -> list[str]:
    low, high = row.quartiles
    target = ""
    if row.target is not None:
        sign = ">=" if row.more_is_better else "<="
        target = f"{sign} {_number(row.target.bound)}"
        if row.target.aim is not None:
            target += f" / {_number(row.target.aim)}"
    return [
        row.what,
        row.unit,
        _number(row.median),
        _number(row.best),
        f"{_number(low)} - {_number(high)}",
        str(len(row.samples)),
        "" if row.baseline is None else _number(row.baseline),
        "" if row.ratio is None else f"x {_number(row.ratio)}",
        target,
        row.verdict or "",
        "" if row.others is None else f"{row.others:.1f}",
    ]


def _stage_cells(stages: Sequence[Stage]) -> list[tuple[str, str, str]]:
    total = sum(stage.microseconds for stage in stages)
    cells = [
        (s.name, f"{s.microseconds:.3f}", f"{100 * s.microseconds / total:.1f} %") for s in stages
    ]
    return [*cells, ("all", f"{total:.3f}", "")]


def _number(figure: float) -> str:
    """Three digits, or whole thousands."""
    return f"{figure:,.0f}" if abs(figure) >= 1000 else f"{figure:.3g}"


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
