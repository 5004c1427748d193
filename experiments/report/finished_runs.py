"""Finished runs, gathered by condition: what figures and claims read."""

from __future__ import annotations

import csv
import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.config import EvolveConfig
from experiments.config.options import options_of
from experiments.io.reading import readable
from experiments.report import intervals
from experiments.runs.champions import Champions
from experiments.runs.names import CHAMPIONS, HISTORY, present

__all__ = ["FinishedRuns", "Table", "find_runs", "gather", "per_run", "runs_in"]

Values = NDArray[np.float64]
Table = dict[str, NDArray[Any]]
"""Columns of a CSV file; numbers are float64, all else is text."""

_SENSORS = ("low", "medium", "high")


@dataclass(frozen=True)
class FinishedRuns:
    """The finished runs of one condition, from one or several folders, in the order of seeds.

    Attributes:
        config: the options, but for those that only say which runs and how they were computed.
        sources: folder, run within it and seed of each run.
        fitness: The fitness of each run's champion as evaluated in evolution [m/s], shape (runs,),
            NaN where it failed.
    """

    config: EvolveConfig
    sources: tuple[tuple[Path, int, int], ...]
    fitness: Values

    @property
    def where(self) -> str:
        """Body and apparatus, such as "biped-4x3 low"."""
        return f"{self.config.shape} {self.config.sensors}"

    @property
    def variant(self) -> dict[str, Any]:
        """The options that are not the paper's, but for shape, sensors, controller, damage."""
        return _variant(self.config)

    @property
    def label(self) -> str:
        """Of the controller: "MLP", "Hebbian", or what is special about it."""
        return label(self.config)

    @property
    def full_label(self) -> str:
        """The same where plastic and static controllers are mixed: "Hebbian, every 12 steps"."""
        is_variant = self.config.controller == "hebbian" and self.label != "Hebbian"
        return f"Hebbian, {self.label}" if is_variant else self.label

    def table(self, name: str) -> Table | None:
        """A CSV file of the condition's folders, with column `run` counting this object's runs.

        Returns:
            None if no folder has such a file.
        """
        parts = []
        for folder in dict.fromkeys(folder for folder, _, _ in self.sources):
            if not (folder / name).is_file():
                continue
            part = _read(folder / name)
            runs = {own: i for i, (home, own, _) in enumerate(self.sources) if home == folder}
            kept = np.isin(part["run"], list(runs))
            part = {column: values[kept] for column, values in part.items()}
            part["run"] = np.array([runs[int(own)] for own in part["run"]], dtype=np.float64)
            parts.append(part)
        if not parts:
            return None
        return {column: np.concatenate([part[column] for part in parts]) for column in parts[0]}

    def files(self, name: str) -> list[tuple[int, int, Path]]:
        """The runs whose folder has a file `name`: run, run within the folder, the file."""
        return [
            (run, own, path)
            for run, (folder, own, _) in enumerate(self.sources)
            if (path := present(folder, name)) is not None
        ]

    def curves(self, column: str = "best") -> Values:
        """A column of history.csv [m/s], shape (runs, generations)."""
        history = self.table(HISTORY)
        if history is None:
            return np.empty((0, 0))
        order = np.lexsort((history["generation"], history["run"]))
        values: Values = history[column][order]
        return values.reshape(len(np.unique(history["run"])), -1)


def label(config: EvolveConfig) -> str:
    """Name of a controller in legends and tables."""
    names = [] if config.controller == "hebbian" else [config.controller.upper()]
    return ", ".join(names + _names(config)) or "Hebbian"


def find_runs(roots: Iterable[Path]) -> list[Path]:
    """All folders of finished runs at or below the roots, sorted."""
    return sorted({path.parent for root in roots for path in root.rglob(CHAMPIONS)})


def gather(run_folders: Sequence[Path]) -> list[FinishedRuns]:
    """The finished runs among folders, by condition; unfinished ones are passed over.

    A run that is there twice (same condition and seed) counts once.

    Returns:
        Conditions sorted by shape, apparatus and controller.

    Raises:
        ValueError: a run cannot be read, or the runs are of different scales (generations,
            population, duration), which cannot be compared.
    """
    members: dict[EvolveConfig, dict[int, tuple[Path, int, float]]] = {}
    scales: dict[tuple[Any, ...], Path] = {}
    for folder in run_folders:
        if not (folder / CHAMPIONS).is_file():
            continue
        champions = Champions.load(folder)
        config = champions.config
        scales.setdefault(
            tuple(getattr(config, name) for name in options_of(EvolveConfig, "scale")), folder
        )
        runs = members.setdefault(_condition(config), {})
        for run, fitness in enumerate(champions.fitness.tolist()):
            runs.setdefault(config.seed + run, (folder, run, fitness))
    _require_one_scale(scales)
    conditions = []
    for config, runs in members.items():
        of_runs = sorted(runs.items())
        conditions.append(
            FinishedRuns(
                config=config,
                sources=tuple((folder, run, seed) for seed, (folder, run, _) in of_runs),
                fitness=np.array([fitness for _, (_, _, fitness) in of_runs]),
            )
        )
    return sorted(conditions, key=_order)


def runs_in(table: Table) -> NDArray[np.intp]:
    """The runs that a table has rows of, in order."""
    return np.unique(table["run"]).astype(np.intp)


def per_run(table: Table, column: str = "speed") -> Values:
    """The median of a column over each run's rows: one number per run, shape (runs,)."""
    return np.array(
        [intervals.middle(table[column][table["run"] == run]) for run in runs_in(table)]
    )


def _variant(config: EvolveConfig) -> dict[str, Any]:
    default = EvolveConfig()
    return {
        name: getattr(config, name)
        for name in options_of(EvolveConfig, "variant")
        if getattr(config, name) != getattr(default, name)
    }


def _names(config: EvolveConfig) -> list[str]:
    options = options_of(EvolveConfig)
    return [options[name].label(value) for name, value in _variant(config).items()]


def _condition(config: EvolveConfig) -> EvolveConfig:
    """The options without those that only say which runs and how they were computed."""
    default = EvolveConfig()
    bookkeeping = options_of(EvolveConfig, "sample", "machine")
    return dataclasses.replace(config, **{name: getattr(default, name) for name in bookkeeping})


def _require_one_scale(scales: dict[tuple[Any, ...], Path]) -> None:
    if len(scales) < 2:
        return
    (first, one), (second, other) = list(scales.items())[:2]
    names = options_of(EvolveConfig, "scale")
    different = [
        f"{name} {a} and {b}" for name, a, b in zip(names, first, second, strict=True) if a != b
    ]
    raise ValueError(
        f"runs: expected runs of one scale, got {', '.join(different)} in {str(one)!r} and "
        f"{str(other)!r}; name folders that belong together"
    )


def _order(condition: FinishedRuns) -> tuple[Any, ...]:
    config = condition.config
    return (
        config.shape,
        _SENSORS.index(config.sensors),
        config.damage,
        config.controller,
        len(condition.variant),
        condition.label,
    )


class _Columns(dict[str, NDArray[Any]]):
    """The columns of a file; one that it lacks is told with the file's name."""

    def __init__(self, path: Path, columns: Mapping[str, NDArray[Any]]) -> None:
        super().__init__(columns)
        self._path = path

    def __missing__(self, name: str) -> NDArray[Any]:
        with readable(self._path):
            raise ValueError(f"it has no column {name!r}")


def _read(path: Path) -> Table:
    with readable(path), path.open(newline="", encoding="utf-8-sig") as file:
        header, *rows = csv.reader(file)
        if not rows:
            raise ValueError("it has no rows")
        columns: Sequence[Sequence[str]] = list(zip(*rows, strict=True))
        table = {name: _numbers(column) for name, column in zip(header, columns, strict=True)}
    return _Columns(path, table)


def _numbers(column: Sequence[str]) -> NDArray[Any]:
    """Numbers, or text; not both, as in a column with a damaged number.

    Raises:
        ValueError: it is both.
    """
    numbers = []
    for value in column:
        with suppress(ValueError):
            numbers.append(float(value))
    if len(numbers) == len(column):
        return np.array(numbers, dtype=np.float64)
    if numbers:
        raise ValueError(f"{len(column) - len(numbers)} of {len(column)} values are no numbers")
    return np.array(column, dtype=np.str_)
