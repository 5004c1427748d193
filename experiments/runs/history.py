"""The course of an evolution: one row per run and generation, as written to history.csv."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import torch
from torch import Tensor

from experiments.io.atomic import write_atomically

__all__ = ["History", "HistoryRow"]


class HistoryRow(NamedTuple):
    """Fitness within one population of one run; failed individuals (NaN) do not count."""

    run: int
    """Index of the run, from 0."""
    generation: int
    """From 1."""
    best: float
    """Highest fitness [m/s]; NaN if every individual failed."""
    median: float
    """Median fitness [m/s]."""
    mean: float
    """Mean fitness [m/s]."""
    q75: float
    """Upper quartile of the fitness [m/s]."""
    evaluations: int
    """Evaluations of this run so far."""
    seconds: float
    """Wall time of the evolution so far [s], all its runs together."""

    @classmethod
    def of(cls, run: int, generation: int, fitness: Tensor, seconds: float) -> HistoryRow:
        """The row of one population.

        Args:
            run: index of the run.
            generation: The number of the generation, from 1.
            fitness: shape (population,) [m/s], NaN where an individual failed.
            seconds: wall time so far [s].
        """
        # One sort gives all: NaN sorts last and is cut off.
        valid = fitness[~fitness.isnan()].double()
        if not len(valid):
            valid = valid.new_full((1,), torch.nan)
        median, q75, best = valid.quantile(valid.new_tensor([0.5, 0.75, 1.0])).tolist()
        return cls(
            run=run,
            generation=generation,
            best=best,
            median=median,
            mean=valid.mean().item(),
            q75=q75,
            evaluations=generation * len(fitness),
            seconds=seconds,
        )


class History:
    """The rows so far, in memory and in history.csv.

    The file follows the rows, which the checkpoint keeps: it is appended to generation by
    generation, and written anew when an evolution is resumed.
    """

    def __init__(self, rows: list[HistoryRow] | None = None) -> None:
        self.rows = list(rows or [])

    @property
    def seconds(self) -> float:
        """Wall time so far [s]."""
        return self.rows[-1].seconds if self.rows else 0.0

    def append(self, rows: list[HistoryRow], path: Path) -> None:
        """Add the rows of one generation, here and at the end of the file."""
        self.rows += rows
        with path.open("a", encoding="utf-8") as file:
            file.writelines(map(_line, rows))

    def write(self, path: Path) -> None:
        """Write the whole file, in place of the one that may be there."""
        lines = [",".join(HistoryRow._fields) + "\n", *map(_line, self.rows)]
        write_atomically(path, "".join(lines).encode())

    def to_tensor(self) -> Tensor:
        """The rows as numbers, shape (rows, columns), float64."""
        table = torch.tensor(self.rows, dtype=torch.float64, device="cpu")
        return table.reshape(-1, len(HistoryRow._fields))

    @classmethod
    def from_tensor(cls, table: Tensor) -> History:
        """The rows that `to_tensor` gave."""
        rows = []
        for run, generation, best, median, mean, q75, evaluations, seconds in table.tolist():
            fitness = (best, median, mean, q75)
            rows.append(HistoryRow(int(run), int(generation), *fitness, int(evaluations), seconds))
        return cls(rows)


def _line(row: HistoryRow) -> str:
    return ",".join(map(repr, row)) + "\n"  # repr of a float reads back exactly
