"""The TensorBoard runs of an evolution, with generations as steps.

One run writes into the folder RUN; several runs into RUN/run-0, RUN/run-1 ..., with their median
and quartiles in an overview: RUN/over-runs, or ROOT/overview/CONDITION in a campaign.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from experiments.config import EvolveConfig
from experiments.config.options import options_of
from experiments.runs.history import HistoryRow
from experiments.runs.provenance import provenance
from experiments.runs.tensorboard.event_file import EventFile

__all__ = ["Tracker", "run_folders"]

_BANDS = ("fitness/best", "fitness/best_so_far", "fitness/median", "fitness/mean", "fitness/q75")
_METRICS = ("fitness/best", "fitness/best_so_far", "fitness/median")


class Tracker:
    """Writes the event files of an evolution.

    Attributes:
        runs: the event file of each run.
        overview: that of the median over the runs, if there is one.
    """

    def __init__(
        self,
        folder: Path,
        config: EvolveConfig,
        generation: int,
        *,
        history: Sequence[HistoryRow] = (),
        overview: Path | None = None,
        validated: Sequence[str] = (),
    ) -> None:
        """Open the event files, to log from a generation on.

        Args:
            folder: The run's folder, RUN.
            config: the options, logged as text and for the HParams tab.
            generation: the first one to be logged; of what an interrupted evolution logged for
                it and later ones, nothing is shown.
            history: rows of the generations before.
            overview: folder of the overview; by default RUN/over-runs, for several runs alone.
            validated: tags of the validation, by which the HParams tab compares runs.
        """
        if overview is None and config.runs > 1:
            overview = folder / "over-runs"
        first = generation if generation > 1 else 0  # the options stand at step 0
        self._config = config
        self._best = _best_so_far(history, config.runs)
        self.runs = [EventFile(path, first) for path in run_folders(folder, config.runs)]
        self.overview: EventFile | None = None
        if overview is not None:
            is_new = not any(overview.glob("events.out.tfevents.*"))
            self.overview = EventFile(overview, first)
            if is_new:
                self._catch_up(history)
        for number, file in enumerate(self._files):
            seed = config.seed + number if file is not self.overview else config.seed
            one = dataclasses.replace(config, seed=seed)
            if generation == 1 or (file is self.overview and is_new):
                file.text("config", _table(one))
                file.options(_compared(one), (*_METRICS, *validated))
            if generation <= config.generations:  # a finished run is not computed any further
                file.text("provenance", provenance(), generation - 1)
        if self.overview is not None and (generation == 1 or is_new):
            bands = {
                tag: (tag, f"quartiles/{tag}/q25", f"quartiles/{tag}/q75")
                for tag in (*_BANDS, *validated)
            }
            self.overview.bands(bands, "median over runs within its quartiles")

    def log(
        self,
        rows: Sequence[HistoryRow],
        metrics: Sequence[Mapping[str, float | None]],
        populations: np.ndarray,
    ) -> None:
        """Write the numbers of one generation.

        Args:
            rows: fitness, one row for each run.
            metrics: other tags and values, a dict for each run.
            populations: fitness of all individuals, shape (runs, population).
        """
        generation = rows[0].generation
        self._best = np.fmax(self._best, [row.best for row in rows])
        all_values = [
            {**_fitness(row, best), **values}
            for row, best, values in zip(rows, self._best, metrics, strict=True)
        ]
        for file, values, fitness in zip(self.runs, all_values, populations, strict=True):
            file.scalars(values, generation)
            file.histogram("fitness/population", fitness, generation)
        if self.overview is not None:
            self.overview.scalars(_over_runs(all_values), generation)

    def log_more(self, generation: int, metrics: Sequence[Mapping[str, float | None]]) -> None:
        """Write numbers that not every generation has, a dict for each run."""
        for file, values in zip(self.runs, metrics, strict=True):
            file.scalars(values, generation)
        if self.overview is not None:
            self.overview.scalars(_over_runs(metrics), generation)

    def end(self) -> None:
        """Tell that the evolution has reached its end."""
        for file in self._files:
            file.ended(self._config.generations)

    def flush(self) -> None:
        """Hand everything logged to the operating system."""
        for file in self._files:
            file.flush()

    def close(self) -> None:
        """Write what is left and close the files."""
        for file in self._files:
            file.close()

    def __enter__(self) -> Tracker:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    @property
    def _files(self) -> list[EventFile]:
        return [*self.runs, *([self.overview] if self.overview is not None else [])]

    def _catch_up(self, history: Sequence[HistoryRow]) -> None:
        """Write the fitness of the generations before into a new overview."""
        assert self.overview is not None
        by_generation: dict[int, list[HistoryRow]] = {}
        for row in history:
            by_generation.setdefault(row.generation, []).append(row)
        best = np.full(self._config.runs, np.nan)
        for generation, rows in by_generation.items():
            best = np.fmax(best, [row.best for row in rows])
            values = [_fitness(row, own) for row, own in zip(rows, best, strict=True)]
            self.overview.scalars(_over_runs(values), generation)


def run_folders(folder: Path, runs: int) -> list[Path]:
    """The folders of the TensorBoard runs of an evolution."""
    return [folder] if runs == 1 else [folder / f"run-{run}" for run in range(runs)]


def _best_so_far(history: Sequence[HistoryRow], runs: int) -> np.ndarray:
    """The best fitness of each run up to now, NaN where there is none."""
    best = np.full(runs, np.nan)
    for row in history:
        best[row.run] = np.fmax(best[row.run], row.best)
    return best


def _fitness(row: HistoryRow, best_so_far: float) -> dict[str, float]:
    return {
        "fitness/best": row.best,
        "fitness/median": row.median,
        "fitness/mean": row.mean,
        "fitness/q75": row.q75,
        "fitness/best_so_far": float(best_so_far),
    }


def _over_runs(metrics: Sequence[Mapping[str, float | None]]) -> dict[str, float | None]:
    """The median over the runs of every tag, with quartiles for those of the fitness and of the
    validation; None where no run has a number."""
    tags = list(metrics[0])
    rows = [[of_run[tag] for tag in tags] for of_run in metrics]
    table = np.array(rows, dtype=np.float64)  # None becomes NaN
    known = np.array([not np.isnan(column).all() for column in table.T])
    quartiles = np.full((3, len(tags)), np.nan)
    quartiles[:, known] = np.nanquantile(table[:, known], (0.25, 0.5, 0.75), axis=0)
    values: dict[str, float | None] = {}
    for tag, (low, middle, high), is_known in zip(tags, quartiles.T, known, strict=True):
        values[tag] = float(middle) if is_known else None
        if is_known and tag.startswith(("fitness/", "validation/")):
            values[f"quartiles/{tag}/q25"] = float(low)
            values[f"quartiles/{tag}/q75"] = float(high)
    return values


def _compared(config: EvolveConfig) -> dict[str, Any]:
    """The options by which runs are compared: all but those of the machine."""
    names = options_of(EvolveConfig, "axis", "variant", "scale", "sample")
    return {name: getattr(config, name) for name in names}


def _table(config: EvolveConfig) -> str:
    """The options as a Markdown table."""
    rows = [f"| {name} | {value} |" for name, value in dataclasses.asdict(config).items()]
    return "\n".join(["| option | value |", "|---|---|", *rows])
