"""The page of a campaign: its conditions, figures and the verdicts on the paper's claims."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from experiments.report.claims.summary import judge
from experiments.report.figures.performance import unseen_per_run
from experiments.report.finished_runs import FinishedRuns, find_runs, gather
from experiments.report.page import charts
from experiments.report.page.html import page, picture, section, table

__all__ = ["campaign_page"]

_MOST_CURVES = 6  # in one chart


def campaign_page(root: Path) -> str:
    """The HTML of a page about all finished runs at or below a folder.

    Raises:
        ValueError: there is none, one cannot be read, or they are of different scales.
    """
    conditions = gather(find_runs([root]))
    if not conditions:
        raise ValueError(
            f"root: expected a run or a campaign with finished runs, got {str(root)!r}; "
            f"`hebbtorch campaign paper --out {root}` makes one"
        )
    data: dict[str, Any] = {"charts": {}}
    config = conditions[0].config
    sections = [
        f"<p class='note'>{len(conditions)} conditions; {config.generations} generations, "
        f"population {config.population}, episodes of {config.duration:g} s.</p>",
        section(
            "Conditions",
            table(
                ("robot", "sensors", "controller", "damage", "runs", "best [m/s]", "q25", "q75",
                 "unseen terrains [m/s]"),
                [_row(condition) for condition in conditions],
            ),
            note="Medians over runs; quartiles of the best individuals of the last generation.",
        ),
        *_curves(conditions, data["charts"]),
        *_claims(conditions),
        *_figures(root),
    ]  # fmt: skip
    return page(f"{root.name}: {len(conditions)} conditions", sections, data)


def _row(condition: FinishedRuns) -> tuple[Any, ...]:
    config, fitness = condition.config, condition.fitness
    quartiles = np.nanquantile(fitness, (0.25, 0.5, 0.75)) if len(fitness) else [np.nan] * 3
    low, middle, high = (float(value) for value in quartiles)
    unseen = unseen_per_run(condition)
    assessed: Any = float(np.nanmedian(unseen)) if len(unseen) else "not yet"
    return (
        config.shape, config.sensors, condition.label, config.damage, len(fitness), middle, low,
        high, assessed,
    )  # fmt: skip


def _curves(conditions: Sequence[FinishedRuns], drawn: dict[str, Any]) -> list[str]:
    """Median best speed by generation, a chart for each robot and apparatus."""
    places: dict[str, list[FinishedRuns]] = {}
    for condition in conditions:
        places.setdefault(condition.where, []).append(condition)
    parts = []
    for number, (where, here) in enumerate(places.items()):
        known = [(each, best) for each in here if (best := each.curves()).size][:_MOST_CURVES]
        if not known:
            continue
        generations = np.arange(1, 1 + max(best.shape[1] for _, best in known))
        curves = [
            charts.curve(
                f"{each.label}{'' if each.config.damage == 'none' else ', damaged'} "
                f"(n = {len(best)})",
                np.nanmedian(best, axis=0),
            )
            for each, best in known
        ]
        drawn[f"curves-{number}"] = charts.chart(generations, curves, "generation", "m/s")
        parts.append(f"<h3>{where}</h3><div id='curves-{number}'></div>")
    if not parts:
        return []
    return [section("Best speed by generation", *parts, note="Median over runs.")]


def _claims(conditions: Sequence[FinishedRuns]) -> list[str]:
    rows = [
        (claim.number, claim.says, claim.source, finding.verdict, finding.reason)
        for claim, finding in judge(conditions)
    ]
    return [section("The paper's claims", table(("", "claim", "in", "verdict", "why"), rows))]


def _figures(root: Path) -> list[str]:
    """Every figure drawn so far, once."""
    found = {path.name: path for path in sorted(root.glob("*/*.png"))}
    pictures = [
        picture(path.read_bytes(), f"{path.stem.replace('_', ' ')} ({path.parent.name})")
        for path in found.values()
    ]
    return [section("Figures", *pictures)] if pictures else []
