"""Folders of finished runs with results made up for a test."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from experiments.analysis.recording import Recording, describe
from experiments.config import EvolveConfig
from experiments.runs.champions import Champions


def write_run(
    root: Path, config: EvolveConfig, fitness: Sequence[float], name: str | None = None
) -> Path:
    """A folder with champions, and a history that rises to their fitness."""
    folder = root / (name or f"run-{len(list(root.iterdir())) if root.exists() else 0}")
    folder.mkdir(parents=True)
    genomes = torch.zeros(len(fitness), 1)
    config = replace(config, runs=len(fitness))
    Champions(config, genomes, torch.tensor(fitness, dtype=torch.float64)).save(folder)
    rows = []
    for generation in range(1, config.generations + 1):
        for run, speed in enumerate(fitness):
            best = speed * generation / config.generations
            rows.append((run, generation, best, best / 2, best / 2, best / 2, 0, 0.0))
    columns = ["run", "generation", "best", "median", "mean", "q75", "evaluations", "seconds"]
    write_csv(folder / "history.csv", columns, rows)
    return folder


def write_csv(path: Path, columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(rows)


def read_csv(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def write_evaluation(folder: Path, config: EvolveConfig, speeds: Sequence[Sequence[float]]) -> None:
    """Speeds on unseen terrains, a row of them for each run."""
    rows = [
        (run, f"{config.terrain}-{seed}", config.damage, speed)
        for run, own in enumerate(speeds)
        for seed, speed in enumerate(own)
    ]
    name = f"evaluation-{config.terrain}-{config.damage}.csv"
    write_csv(folder / name, ["run", "terrain", "damage", "speed"], rows)


def write_freezing(folder: Path, speeds: Sequence[Sequence[float]]) -> None:
    """Speeds once weights are frozen, for each run a row by the second."""
    rows = [
        (run, second, "hilly-3-30-1", speed)
        for run, own in enumerate(speeds)
        for second, speed in enumerate(own)
    ]
    write_csv(folder / "freeze.csv", ["run", "second", "terrain", "speed"], rows)


def write_paired(
    folder: Path, plastic: Sequence[float], frozen: Sequence[float], generation: int = 10
) -> None:
    """Speeds of each run's champion on three terrains, plastic and with weights frozen at 20 s."""
    rows = [
        (generation, run, f"hilly-3-30-{k}", frozen_at, speed + k - 1)
        for frozen_at, speeds in ((float("nan"), plastic), (20.0, frozen))
        for run, speed in enumerate(speeds)
        for k in range(3)
    ]
    columns = ["generation", "run", "terrain", "frozen_at", "speed"]
    write_csv(folder / "paired.csv", columns, rows)


def write_generalization(folder: Path, training: Sequence[float], unseen: Sequence[float]) -> None:
    """Speeds of each run's champion on terrains of its evolution and on unseen ones."""
    rows = [
        (setting, run, f"hilly-3-30-{k}", speed + k - 1)
        for setting, speeds in (("training", training), ("unseen", unseen))
        for run, speed in enumerate(speeds)
        for k in range(3)
    ]
    write_csv(folder / "generalization.csv", ["setting", "run", "terrain", "speed"], rows)


def write_recording(
    folder: Path, runs: int, *, growth: float = 4.0, period: float = 1.5, gain: float = 20.0
) -> None:
    """Episodes with weights that grow, and with neurons that cycle with the gait.

    Args:
        folder: of the run.
        runs: how many episodes.
        growth: of the weights between the second and the third time.
        period: of gait and neurons [s].
        gain: of the neurons; a large one saturates them.
    """
    rng = np.random.default_rng(0)
    times = np.arange(600) / 60
    phases = np.array([0.0, 1.0, 2.0])
    waves = np.sin(2 * np.pi * times[:, None] / period + phases)
    neurons = np.tile(np.tanh(gain * waves), (runs, 1, 1))
    weights = rng.normal(size=(runs, 1, 3, 4)) * np.array([0.1, 1, growth])[:, None, None]
    weights[:, :, 0, 0] *= 20  # has diverged
    counts = np.histogram(neurons[0], 40, (-1, 1))[0]
    recording = Recording(
        times=[1.0, 15.0, 60.0],
        weights=(weights.astype(np.float32), weights[:, :, :2, :3].astype(np.float32)),
        histograms=np.tile(counts, (runs, 2, 1)),
        activations=(neurons.astype(np.float16), neurons[..., :2].astype(np.float16)),
        areas=(1 + 0.1 * np.tile(waves, (runs, 1, 1))).astype(np.float16),
        touching=np.zeros((runs, 600, 3), dtype=bool),
        way=np.zeros((runs, 3600, 2), dtype=np.float32),
        terms=np.ones((runs, 3, 4)),
    )
    (folder / "recording.npz").write_bytes(recording.to_npz())
    (folder / "recording.json").write_text(json.dumps({"runs": describe(recording)}))
