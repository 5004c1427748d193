"""The page of one run: its champion's episode, curves, assessments and options."""

from __future__ import annotations

import csv
import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from experiments.analysis.recorder import record
from experiments.analysis.trajectory import Trajectory
from experiments.report.page import charts
from experiments.report.page.episode_data import EVERY, WEIGHTS_EVERY, episode_data
from experiments.report.page.html import page, picture, section, table
from experiments.runs.champions import Champions
from experiments.runs.names import FREEZING, HISTORY
from experiments.runs.provenance import provenance_of
from experiments.runs.tensorboard.tracker import run_folders

__all__ = ["run_page"]

_FROZEN_AFTER = 1 / 3  # share of the episode after which the weights of one are frozen

Table = list[dict[str, str]]


def run_page(folder: Path, seed: int = 0) -> str:
    """The HTML of a run's page.

    Args:
        folder: The folder of a finished run.
        seed: The seed of terrain, noise and damage of the episodes shown.

    Raises:
        ValueError: the run cannot be read, or the simulation of its champion fails at once.
    """
    champions = Champions.load(folder)
    config, best = champions.config, champions.best_run
    episodes = _episodes(champions, seed)
    data: dict[str, Any] = {
        "episodes": [
            episode_data(course, name, inside=i == 0)
            for i, (name, course) in enumerate(episodes.items())
        ],
        "charts": {},
    }
    names = ", ".join(f"{speed:.2f}" for speed in champions.fitness.tolist())
    sections = [
        f"<p class='note'>{len(champions.genomes)} run(s) of {config.generations} generations; "
        f"champions: {names} m/s. Below, that of run {best}.</p>",
        section(
            "An episode of the champion",
            "<div id='episode'></div>",
            note="On a terrain that its evolution never met. Orange voxels contract, blue ones "
            "expand, broken ones are hatched. Press Play or the space bar; click into a picture "
            "to go to its time.",
        ),
        *_course(folder, config.runs, data["charts"]),
        *_evaluations(folder),
        *_freezing(folder, data["charts"]),
        *_pictures(folder),
        section("Options", table(("option", "value"), dataclasses.asdict(config).items())),
        section("Provenance", table(("", ""), provenance_of(folder).items())),
    ]
    return page(f"{folder.name}: {next(iter(episodes.values())).title}", sections, data)


def _episodes(champions: Champions, seed: int) -> dict[str, Trajectory]:
    """The champion as it is, with broken voxels, and with weights that no longer change."""
    config, genome = champions.config, champions.genomes[champions.best_run]
    whole = replace(config, damage="none")
    found = {
        "champion": record(whole, genome, seed=seed, every=EVERY, weights_every=WEIGHTS_EVERY),
        "damaged": record(replace(config, damage="half"), genome, seed=seed, every=EVERY),
    }
    if config.controller == "hebbian":
        second = float(round(config.duration * _FROZEN_AFTER)) or config.duration * _FROZEN_AFTER
        found[f"weights frozen at {second:g} s"] = record(
            whole, genome, seed=seed, every=EVERY, freeze_at=second
        )
    return found


def _course(folder: Path, runs: int, drawn: dict[str, Any]) -> list[str]:
    """Fitness and validation by generation."""
    rows = _read(folder / HISTORY)
    if not rows:
        return []
    generations = np.unique([int(row["generation"]) for row in rows])
    columns = {name: _by_run(rows, name, runs) for name in ("best", "median", "mean", "q75")}
    if runs == 1:
        curves = [charts.curve(name, values[0]) for name, values in columns.items()]
        drawn["fitness"] = charts.chart(generations, curves, "generation", "m/s")
    else:
        drawn["fitness"] = charts.band(generations, columns["best"], "best", "generation", "m/s")
    parts = ["<h3>fitness of the population</h3><div id='fitness'></div>"]
    if validation := _validation(folder, runs):
        steps, curves = validation
        drawn["validation"] = charts.chart(steps, curves, "generation", "m/s")
        parts.append(
            "<h3>the champion on fixed terrains, which select nothing</h3>"
            "<div id='validation'></div>"
        )
    note = (
        "The best of a generation is the luckiest of its population: its speed is biased upwards. "
        "The validation is not."
    )
    return [section("Evolution", *parts, note=note)]


def _validation(folder: Path, runs: int) -> tuple[np.ndarray, list[dict[str, Any]]] | None:
    """Generations, and a curve for each kind of terrain: the median over the runs."""
    found: dict[str, list[dict[int, float]]] = {}
    for path in run_folders(folder, runs):
        if not any(path.glob("events.out.tfevents.*")):
            continue
        events = EventAccumulator(str(path), {"scalars": 0}).Reload()
        for tag in events.Tags()["scalars"]:
            if tag.startswith("validation/"):
                values = {event.step: event.value for event in events.Scalars(tag)}
                found.setdefault(tag.removeprefix("validation/"), []).append(values)
    if not found:
        return None
    steps = np.array(sorted({step for each in found.values() for run in each for step in run}))
    curves = []
    for kind, by_run in found.items():
        rows = [[run.get(step, np.nan) for step in steps.tolist()] for run in by_run]
        curves.append(charts.curve(kind, np.nanmedian(np.array(rows), axis=0), points=True))
    return steps, curves


def _evaluations(folder: Path) -> list[str]:
    """Re-assessments on unseen terrains, if there were any."""
    rows = []
    for path in sorted(folder.glob("evaluation-*.csv")):
        found = _read(path)
        for run in sorted({int(row["run"]) for row in found}):
            speeds = np.array([float(r["speed"]) for r in found if int(r["run"]) == run])
            low, middle, high = np.nanquantile(speeds, (0.25, 0.5, 0.75)).tolist()
            failed = int(np.isnan(speeds).sum())
            conditions = path.stem.removeprefix("evaluation-")
            rows.append((conditions, run, len(speeds), middle, low, high, failed))
    if not rows:
        return [_hint("Unseen terrains", f"hebbtorch evaluate {folder}")]
    head = ("terrain and damage", "run", "terrains", "median [m/s]", "q25", "q75", "failed")
    return [section("Unseen terrains", table(head, rows))]


def _freezing(folder: Path, drawn: dict[str, Any]) -> list[str]:
    """Speed with frozen weights, if it was measured."""
    heading = "Weights frozen at each second"
    rows = _read(folder / FREEZING)
    if not rows:
        return [_hint(heading, f"hebbtorch freeze {folder}")]
    seconds = np.unique([int(row["second"]) for row in rows])
    runs = np.unique([int(row["run"]) for row in rows])
    speeds = np.full((len(runs), len(seconds)), np.nan)
    for i, run in enumerate(runs.tolist()):
        for k, second in enumerate(seconds.tolist()):
            own = [
                float(row["speed"])
                for row in rows
                if int(row["run"]) == run and int(row["second"]) == second
            ]
            speeds[i, k] = np.nanmean(own) if not np.isnan(own).all() else np.nan
    drawn["freezing"] = charts.band(seconds, speeds, "speed", "weights frozen at [s]", "m/s")
    return [section(heading, "<div id='freezing'></div>")]


def _pictures(folder: Path) -> list[str]:
    """The page of stills, if it is there."""
    path = folder / "gait.png"
    if not path.is_file():
        return []
    return [section("Gait", picture(path.read_bytes(), "A cycle of the gait, and the way made."))]


def _hint(heading: str, command: str) -> str:
    return section(heading, note=f"Not measured yet: {command}")


def _by_run(rows: Sequence[Mapping[str, str]], column: str, runs: int) -> np.ndarray:
    """A column of history.csv, shape (runs, generations)."""
    return np.array(
        [[float(row[column]) for row in rows if int(row["run"]) == run] for run in range(runs)]
    )


def _read(path: Path) -> Table:
    """The rows of a CSV file; none if there is no file."""
    if not path.is_file():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))
