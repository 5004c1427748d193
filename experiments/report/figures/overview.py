"""What medians of final speeds hide: when a gait is found, in how many runs, and how fast it is."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from experiments.io import style
from experiments.report import aggregates, intervals, statistics, survival, tables
from experiments.report.finished_runs import FinishedRuns, gather
from experiments.report.survival import Times

__all__ = ["TAKEOFF_SPEED", "profiles", "takeoff", "takeoff_times"]

TAKEOFF_SPEED = 1.0
"""A run has found a gait once the best of a generation is faster [m/s]."""

_PANEL = (2.2, 1.7)  # [in]
_LEVELS = 41  # of a profile

Values = NDArray[np.float64]


def takeoff(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Share of runs without a gait against generations (Kaplan-Meier), and when one is found."""
    found = _undamaged(run_folders)
    times = {i: takeoff_times(each) for i, each in enumerate(found)}
    drawn = [i for i, each in times.items() if len(each)]
    if not drawn:
        return []
    found, of_runs = [found[i] for i in drawn], [times[i] for i in drawn]
    shapes = list(dict.fromkeys(each.config.shape for each in found))
    columns = list(dict.fromkeys(each.config.sensors for each in found))
    looks = style.looks(list(dict.fromkeys(each.full_label for each in found)))
    size = (len(shapes), len(columns))
    with style.sheet(out, "takeoff", _PANEL, *size, sharex="all", sharey="all") as sheet:
        for (row, shape), (column, sensors) in itertools.product(
            enumerate(shapes), enumerate(columns)
        ):
            axes = sheet.panel(row, column)
            axes.set(title=f"{shape} {sensors}", ylim=(-0.03, 1.03))
            for each, own in zip(found, of_runs, strict=True):
                if (each.config.shape, each.config.sensors) == (shape, sensors):
                    _draw_survival(axes, own, looks[each.full_label])
            if row == len(shapes) - 1:
                axes.set_xlabel("generation")
            if column == 0:
                axes.set_ylabel(f"runs below {TAKEOFF_SPEED:g} m/s")
        sheet.legend(_handles(looks))
    caption = (
        f"Runs whose best individual of a generation was faster than {TAKEOFF_SPEED:g} m/s, the "
        "generation in which half of the runs were so for the first time (Kaplan-Meier; n/a if "
        "fewer ever were), and the final speed [m/s]. Log-rank test against the MLP without "
        "variants at the same place, corrected by Holm over the table; runs that never were are "
        "censored at their end."
    )
    return [*sheet.files, *tables.write(_takeoff_rows(found, of_runs), out, "takeoff", caption)]


def takeoff_times(condition: FinishedRuns) -> Times:
    """Generations in which the runs of a condition found a gait."""
    curves = condition.curves()
    if not curves.size:
        return Times(np.empty(0), np.empty(0, dtype=bool))
    return survival.first_above(curves, TAKEOFF_SPEED)


def profiles(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Share of runs faster than a speed, over all apparatuses of a shape, and the aggregates."""
    by_shape: dict[str, dict[str, list[FinishedRuns]]] = {}
    for each in _undamaged(run_folders):
        by_shape.setdefault(each.config.shape, {}).setdefault(each.full_label, []).append(each)
    if not by_shape:
        return []
    looks = style.looks(list(dict.fromkeys(label for own in by_shape.values() for label in own)))
    with style.sheet(out, "profiles", _PANEL, 1, len(by_shape), sharey="all") as sheet:
        for column, (shape, by_label) in enumerate(by_shape.items()):
            axes = sheet.panel(0, column)
            fastest = max(np.nanmax(each.fitness) for own in by_label.values() for each in own)
            levels = np.linspace(0.0, fastest, _LEVELS)
            for label, own in by_label.items():
                share, low, high = aggregates.profile([each.fitness for each in own], levels)
                axes.plot(levels, share, color=looks[label].color, ls=looks[label].line)
                axes.fill_between(levels, low, high, color=looks[label].color, alpha=0.2, lw=0)
            axes.set(title=shape, xlabel="speed [m/s]", ylim=(0, 1))
        sheet.panel(0).set_ylabel("runs that are faster")
        sheet.legend(_handles(looks))
    caption = (
        "All apparatuses of a shape together: interquartile mean of the final speed [m/s], and the "
        "mean over apparatuses of the probability that a run is faster than one of the MLP (A12), "
        "with 95 % intervals of a bootstrap that is stratified by apparatus."
    )
    return [*sheet.files, *tables.write(_aggregate_rows(by_shape), out, "profiles", caption)]


def _undamaged(run_folders: Sequence[Path]) -> list[FinishedRuns]:
    return [each for each in gather(run_folders) if each.config.damage == "none"]


def _draw_survival(axes: Axes, times: Times, look: style.Look) -> None:
    x, share = times.survival()
    axes.step(x, share, where="post", color=look.color, ls=look.line)
    censored = times.times[~times.happened]
    if len(censored):
        axes.plot([censored.max()], [share[-1]], "|", color=look.color)


def _handles(looks: dict[str, style.Look]) -> list[Line2D]:
    return [
        Line2D([], [], color=look.color, ls=look.line, label=label) for label, look in looks.items()
    ]


def _takeoff_rows(found: Sequence[FinishedRuns], of_runs: Sequence[Times]) -> list[dict[str, Any]]:
    baselines = {
        each.where: times
        for each, times in zip(found, of_runs, strict=True)
        if each.full_label == "MLP"
    }
    p_values = {
        i: survival.log_rank(times, baselines[each.where])
        for i, (each, times) in enumerate(zip(found, of_runs, strict=True))
        if each.full_label != "MLP" and each.where in baselines
    }
    corrected = dict(zip(p_values, statistics.holm(list(p_values.values())), strict=True))
    return [
        {
            "where": each.where,
            "controller": each.full_label,
            "n": len(times),
            "took_off": int(times.happened.sum()),
            "median_generation": times.median,
            "p": p_values.get(i, float("nan")),
            "p_holm": corrected.get(i, float("nan")),
            "median_speed": intervals.middle(each.fitness),
        }
        for i, (each, times) in enumerate(zip(found, of_runs, strict=True))
    ]


def _aggregate_rows(by_shape: dict[str, dict[str, list[FinishedRuns]]]) -> list[dict[str, Any]]:
    rows = []
    for shape, by_label in by_shape.items():
        baselines = {each.where: each.fitness for each in by_label.get("MLP", [])}
        for label, own in by_label.items():
            mean = aggregates.interquartile_mean([each.fitness for each in own])
            row: dict[str, Any] = {
                "shape": shape,
                "controller": label,
                "apparatuses": ", ".join(each.config.sensors for each in own),
                "n": sum(len(each.fitness) for each in own),
                "iqm": mean.value,
                "iqm_low": mean.low,
                "iqm_high": mean.high,
            }
            pairs = [(c.fitness, baselines[c.where]) for c in own if c.where in baselines]
            if label != "MLP" and pairs:
                a12 = aggregates.mean_a12(pairs)
                row |= {"a12": a12.value, "a12_low": a12.low, "a12_high": a12.high}
            rows.append(row)
    return rows
