"""Studies: a question, the conditions that answer it, and what is made of their results."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from experiments.campaign.grid import Condition, Grid, Scale, check_options, check_value
from experiments.config import EvolveConfig

__all__ = ["Study", "read_study"]


@dataclass(frozen=True, eq=False)
class Study:
    """One question.

    Attributes:
        name: The name of its script and of its folder.
        question: what it asks, a sentence.
        grids: The grids of its conditions.
        analyses: functions of `experiments.analysis.registry`, applied to every finished condition.
        figures: functions of `experiments.report.figures`, applied to all of them together.
    """

    name: str
    question: str
    grids: tuple[Grid, ...]
    analyses: tuple[str, ...] = ()
    figures: tuple[str, ...] = ()

    def conditions(self, scale: Scale) -> list[Condition]:
        """All conditions, validated; each once, though several grids may hold it.

        Raises:
            ValueError: a grid is wrong.
        """
        found = {
            condition.name: condition for grid in self.grids for condition in grid.expand(scale)
        }
        return list(found.values())


def read_study(path: Path) -> Study:
    """A grid of one's own, from a TOML file; the study is called like the file.

    The file has a table [base], options and their values, and a table [axes], options and the
    lists of values that they go through; both as in `hebbtorch evolve`.

    Raises:
        ValueError: the file cannot be read, or is not such a grid.
    """
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError, RecursionError) as error:
        raise ValueError(f"grid: cannot read {str(path)!r}: {error}") from None
    if unknown := sorted(content.keys() - {"base", "axes"}):
        raise ValueError(f"grid: expected tables [base] and [axes], got {', '.join(unknown)}")
    base, axes = _table(content, "base"), _table(content, "axes")
    check_options("base", base)
    for option, value in base.items():
        check_value(option, value)
    if both := sorted(base.keys() & axes.keys()):
        raise ValueError(f"grid: expected {both[0]} in [base] or in [axes], got it in both")
    grid = Grid(replace(EvolveConfig(), **base), axes)
    return Study(path.stem, f"the grid of {path.name}", (grid,))


def _table(content: dict[str, Any], name: str) -> dict[str, Any]:
    table = content.get(name, {})
    if not isinstance(table, dict):
        raise ValueError(f"grid: expected [{name}] to be a table, got {table!r}")
    return table
