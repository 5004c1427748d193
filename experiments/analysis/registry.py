"""What is measured of a finished run, each by a function of its folder that writes one file there.

A file that is there already is left as it is. All follow from the run and fixed seeds, and the
conditions are those of its evolution, unless it is their purpose to vary them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from experiments.analysis import (
    endurance,
    gaits,
    generalization,
    paired,
    pruning,
    recording,
    recovery,
    settling,
)
from experiments.analysis import validation_matrix as validation
from experiments.analysis.freezing import freeze, plastic_champions
from experiments.analysis.unseen import assess
from experiments.io.csvfile import write_csv
from experiments.runs import names
from experiments.runs.champions import Champions

__all__ = [
    "endured",
    "frozen",
    "gaits_watched",
    "generalized",
    "matrix",
    "paired_speeds",
    "pruned",
    "random_genomes",
    "recorded",
    "recovered",
    "settled",
    "unseen_terrains",
]


def unseen_terrains(run_folder: Path) -> Path:
    """Champions on 10 terrains that evolution never met: evaluation-TERRAIN-DAMAGE.csv.

    Raises:
        ValueError: the run cannot be read.
    """
    out = run_folder / names.evaluation_file(Champions.load(run_folder).config)
    if out.exists():
        return out
    assessment = assess(run_folder, names.EVALUATION_TERRAINS)
    assessment.log(run_folder)
    return assessment.write(out)


def endured(run_folder: Path) -> Path:
    """Champions in episodes ten times as long as those of their evolution: endurance.csv.

    Raises:
        ValueError: the run cannot be read.
    """
    return _table(run_folder, names.ENDURANCE, endurance.COLUMNS, endurance.rows)


def recovered(run_folder: Path) -> Path:
    """Champions before and after damage, and without any: recovery.csv.

    Raises:
        ValueError: the run cannot be read, or voxels break at one of the ends of its episodes.
    """
    return _table(run_folder, names.RECOVERY, recovery.COLUMNS, recovery.rows)


def gaits_watched(run_folder: Path) -> Path:
    """Frequency and vibration of the gaits of champions, plastic or static: gaits.csv.

    Raises:
        ValueError: the run cannot be read.
    """
    return _table(run_folder, names.GAITS, gaits.COLUMNS, gaits.rows)


def frozen(run_folder: Path) -> Path:
    """Champions with weights frozen at each second of an episode: freeze.csv.

    Raises:
        ValueError: the run cannot be read, or its controllers are static.
    """
    out = run_folder / names.FREEZING
    if out.exists():
        return out
    champions = plastic_champions(run_folder)
    freezing = freeze(champions)
    freezing.log(run_folder, champions.config.runs)
    return freezing.write(out)


def paired_speeds(run_folder: Path) -> Path:
    """Champions, and those of generations before, plastic and frozen: paired.csv.

    Raises:
        ValueError: the run cannot be read.
    """
    out = run_folder / names.PAIRED
    return out if out.exists() else paired.write(run_folder)


def generalized(run_folder: Path) -> Path:
    """Champions where something is different from their evolution: generalization.csv.

    Raises:
        ValueError: the run cannot be read.
    """
    return _table(run_folder, names.GENERALIZATION, generalization.COLUMNS, generalization.rows)


def recorded(run_folder: Path) -> Path:
    """Weights, neurons and gaits of champions: recording.json, with recording.npz beside it.

    Raises:
        ValueError: the run cannot be read, or its controllers are static.
    """
    found = names.present(run_folder, names.RECORDING_MEASURES)
    return found or recording.write(run_folder)


def random_genomes(run_folder: Path) -> Path:
    """What `recorded` tells of champions, of random individuals: random_genomes.json.

    Raises:
        ValueError: the run cannot be read, or its controllers are static.
    """
    out = run_folder / names.RANDOM_GENOMES
    return out if out.exists() else recording.write_random(run_folder)


def settled(run_folder: Path) -> Path:
    """Whether the weights of champions come to rest, with or without learning: settling.csv.

    Raises:
        ValueError: the run cannot be read, or its controllers are static.
    """
    out = run_folder / names.SETTLING
    return out if out.exists() else settling.write(run_folder)


def pruned(run_folder: Path) -> Path:
    """Champions with pruned synapses: pruned.csv.

    Raises:
        ValueError: the run cannot be read, or its controllers are static.
    """
    out = run_folder / names.PRUNING
    return out if out.exists() else pruning.prune(plastic_champions(run_folder)).write(out)


def matrix(run_folder: Path) -> Path:
    """Champions on all kinds of ground, whole and damaged: matrix.csv.

    Raises:
        ValueError: the run cannot be read.
    """
    out = run_folder / names.MATRIX
    return out if out.exists() else validation.validate(Champions.load(run_folder)).write(out)


def _table(
    run_folder: Path,
    name: str,
    columns: Sequence[str],
    rows: Callable[[Champions], Iterable[Sequence[Any]]],
) -> Path:
    """A table of a run's champions, where it is not there already."""
    out = run_folder / name
    return out if out.exists() else write_csv(out, columns, rows(Champions.load(run_folder)))
