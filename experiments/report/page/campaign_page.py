"""The page of a campaign: its conditions, figures and the verdicts on the paper's claims."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from experiments.analysis.recorder import record
from experiments.report.bundle import unpacked
from experiments.report.claims.summary import judge
from experiments.report.conditions import READABLE_CAPTION, readable_rows
from experiments.report.finished_runs import FinishedRuns, find_runs, gather
from experiments.report.page import charts
from experiments.report.page.episode_data import EVERY, WEIGHTS_EVERY, episode_data
from experiments.report.page.html import page, picture, section, table
from experiments.runs.champions import Champions

__all__ = ["campaign_page"]

_MOST_CURVES = 6  # in one chart
_MOST_EPISODES = 4  # beside each other


def campaign_page(root: Path, seed: int = 0) -> str:
    """The HTML of a page about all finished runs at or below a folder, packed or not.

    Args:
        root: folder of a campaign, or any folder with finished runs below it.
        seed: The seed of terrain, noise and damage of the episodes shown.

    Raises:
        ValueError: there is none, one cannot be read, or they are of different scales.
    """
    with unpacked([root]) as folders:
        return _page(root, gather(find_runs(folders)), seed)


def _page(root: Path, conditions: Sequence[FinishedRuns], seed: int) -> str:
    if not conditions:
        raise ValueError(
            f"root: expected a run or a campaign with finished runs, got {str(root)!r}; "
            f"`hebbtorch campaign paper --out {root}` makes one"
        )
    data: dict[str, Any] = {"episodes": _episodes(conditions, seed), "charts": {}}
    config, rows = conditions[0].config, readable_rows(conditions)
    sections = [
        f"<p class='note'>{len(conditions)} conditions; {config.generations} generations, "
        f"population {config.population}, episodes of {config.duration:g} s.</p>",
        section(
            "Conditions",
            table(tuple(rows[0]), [tuple(row.values()) for row in rows]),
            note=READABLE_CAPTION,
        ),
        *_champions(data["episodes"]),
        *_curves(conditions, data["charts"]),
        *_claims(conditions),
        *_figures(root),
    ]
    return page(f"{root.name}: {len(conditions)} conditions", sections, data)


def _episodes(conditions: Iterable[FinishedRuns], seed: int) -> list[dict[str, Any]]:
    """The best champion of each robot and kind of controller without damage, fastest first."""
    best: dict[tuple[str, str], FinishedRuns] = {}
    for each in conditions:
        place = (each.config.shape, each.config.controller)
        is_whole = each.config.damage == "none" and not np.isnan(each.fitness).all()
        if is_whole and (place not in best or _fastest(each) > _fastest(best[place])):
            best[place] = each
    shown: list[dict[str, Any]] = []
    for each in sorted(best.values(), key=_fastest, reverse=True)[:_MOST_EPISODES]:
        folder, run, _ = each.sources[int(np.nanargmax(each.fitness))]
        champions = Champions.load(folder)
        with contextlib.suppress(ValueError):  # its simulation fails on this terrain
            course = record(
                champions.config, champions.genomes[run], seed=seed, every=EVERY,
                weights_every=WEIGHTS_EVERY,
            )  # fmt: skip
            name = f"{each.where}, {each.label}"
            shown.append(episode_data(course, name, inside=not shown))
    return shown


def _fastest(condition: FinishedRuns) -> float:
    return float(np.nanmax(condition.fitness))


def _champions(episodes: Sequence[dict[str, Any]]) -> list[str]:
    if not episodes:
        return []
    note = (
        "The best champion of each robot and kind of controller, beside each other, on a terrain "
        "that their evolution never met; weights and activations are those of the first."
    )
    return [section("Episodes of champions", "<div id='episode'></div>", note=note)]


def _curves(conditions: Sequence[FinishedRuns], drawn: dict[str, Any]) -> list[str]:
    """Median best speed by generation, a chart for each robot and apparatus."""
    places: dict[str, list[FinishedRuns]] = {}
    for condition in conditions:
        places.setdefault(condition.where, []).append(condition)
    parts = []
    for number, (where, here) in enumerate(places.items()):
        known = [(each, best) for each in here if (best := each.curves()).size]
        if not known:
            continue
        known.sort(key=lambda pair: -np.nan_to_num(np.nanmedian(pair[1][:, -1]), nan=-np.inf))
        rest = len(known) - _MOST_CURVES
        known = known[:_MOST_CURVES]
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
        others = f" (the fastest; {rest} more are in the table)" if rest > 0 else ""
        parts.append(f"<h3>{where}{others}</h3><div id='curves-{number}'></div>")
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
