"""The loop of an evolution: generation by generation in its folder, resumable at any moment."""

from __future__ import annotations

import time
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

from torch import Tensor

from experiments.config import EvolveConfig
from experiments.config.options import options_of
from experiments.evolution.metrics import measure
from experiments.evolution.observation import Observer, is_filmed, is_observed, validation_tags
from experiments.evolution.optimizers import optimizer_of
from experiments.evolution.showing import show
from experiments.rollout.episode import Outcome
from experiments.rollout.evaluate import Evaluator
from experiments.runs.archive import Archive
from experiments.runs.champions import Champions
from experiments.runs.folder import Checkpoint, RunStore
from experiments.runs.history import HistoryRow
from experiments.runs.tensorboard import Tracker
from physics import steps_in

__all__ = ["Evolution", "Session"]


class Evolution:
    """The strategy and the evaluation of one evolution.

    Attributes:
        config: Its options, those of the machine being what it is computed with now.
    """

    def __init__(self, config: EvolveConfig) -> None:
        self.config = config
        self.evaluator = Evaluator(config)
        self.strategy = optimizer_of(config, self.evaluator.n_genes)


class Session:
    """An evolution at work in its folder, RUN. Use :meth:`create` or :meth:`resume`.

    Attributes:
        folder: The run's folder, RUN.
        config: The options of the evolution, as its folder has them.
        generation: How many generations are done.
        tracker: the TensorBoard files.
    """

    def __init__(
        self,
        evolution: Evolution,
        store: RunStore,
        start: Checkpoint,
        archive: Archive,
        overview: Path | None = None,
    ) -> None:
        self.folder = store.folder
        self.config = store.config
        self.generation = start.generation
        self._evolution = evolution
        self._store = store
        self._history = start.history
        self._archive = archive
        self._observer = Observer(evolution.config)
        with ExitStack() as resources:
            resources.enter_context(store)
            self.tracker = resources.enter_context(
                Tracker(
                    store.folder,
                    store.config,
                    start.generation + 1,
                    history=start.history.rows,
                    overview=overview,
                    validated=validation_tags(store.config),
                )
            )
            self._resources = resources.pop_all()
        self._started = time.perf_counter() - start.history.seconds

    @classmethod
    def open(cls, config: EvolveConfig, folder: Path, *, overview: Path | None = None) -> Session:
        """Begin an evolution in a folder, or take it up where it stood if the folder exists.

        Arguments and errors are those of `create` and `resume`.
        """
        if folder.exists():
            machine = {name: getattr(config, name) for name in options_of(EvolveConfig, "machine")}
            return cls.resume(folder, machine=machine, overview=overview)
        return cls.create(config, folder, overview=overview)

    @classmethod
    def create(cls, config: EvolveConfig, folder: Path, *, overview: Path | None = None) -> Session:
        """Begin an evolution in a new folder.

        Args:
            config: The options of the evolution.
            folder: must not exist yet, or be empty.
            overview: folder of the TensorBoard run with the median over the runs; by default
                RUN/over-runs, if there are several.

        Raises:
            ValueError: an option is wrong, or the folder cannot be used; nothing was written then.
        """
        config.validate()
        evolution = Evolution(config)
        start = Checkpoint(generation=0, strategy=evolution.strategy.state_dict())
        archive = Archive.empty(config, evolution.evaluator.n_genes)
        return cls(evolution, RunStore.create(folder, config, start), start, archive, overview)

    @classmethod
    def resume(
        cls,
        folder: Path,
        generations: int | None = None,
        *,
        machine: Mapping[str, Any] | None = None,
        overview: Path | None = None,
    ) -> Session:
        """Take up an evolution where it stood.

        Args:
            folder: The folder of the run.
            generations: how many it shall have from now on; None: as many as before.
            machine: Options of the machine that differ from those it was begun with, such as
                "threads" and "device"; the folder keeps its own.
            overview: as in `create`.

        Raises:
            ValueError: the folder cannot be used; nothing was changed then.
        """
        store, checkpoint = RunStore.resume(folder, generations)
        with ExitStack() as undo:
            undo.enter_context(store)
            evolution = Evolution(_here(store.config, machine or {}))
            evolution.strategy.load_state_dict(checkpoint.strategy)
            archive = Archive.load(store.folder)
            if archive is None:
                archive = Archive.empty(store.config, evolution.evaluator.n_genes)
            if archive.config != store.config:  # the run was given another length
                archive = replace(archive, config=store.config)
                archive.save(store.folder)
            undo.pop_all()
        own = archive.until(checkpoint.generation)
        return cls(evolution, store, checkpoint, own, overview)

    @property
    def evolved(self) -> bool:
        """Whether all generations are done."""
        return self.generation >= self.config.generations

    def step(self) -> tuple[list[HistoryRow], float]:
        """One generation.

        Returns:
            Its rows, one for each run, and evaluations per second.
        """
        config, strategy = self.config, self._evolution.strategy
        generation, began = self.generation + 1, time.perf_counter()
        genomes = strategy.ask()
        outcome = self._evolution.evaluator(self._by_run(genomes), generation)
        fitness = self._by_run(outcome.speed.cpu()).squeeze(-1)
        strategy.tell(fitness.reshape(genomes.shape[:-1]))
        self._store.require_own()
        now = time.perf_counter()
        rows = [
            HistoryRow.of(run, generation, fitness[run], now - self._started)
            for run in range(config.runs)
        ]
        self._log(rows, self._by_run(genomes), fitness, outcome, now - began)
        # In this order, whatever a kill leaves behind is no older than the checkpoint.
        if Archive.keeps(generation):
            self._archive = self._archive.with_generation(
                generation, self._by_run(genomes), fitness
            )
            self._archive.save(self.folder)
        self._history.append(rows, self._store.history_file)
        self._store.save(Checkpoint(generation, strategy.state_dict(), self._history))
        self.generation = generation
        return rows, config.runs * config.population / (now - began)

    def finish(self) -> Champions:
        """Keep the champions, once the evolution is done.

        Returns:
            The champions, ready to be computed with as the evolution was.
        """
        strategy, runs = self._evolution.strategy, self.config.runs
        self._store.require_own()
        champions = Champions(
            self.config, strategy.best.reshape(runs, -1), strategy.best_fitness.reshape(runs)
        )
        champions.save(self.folder)
        self.tracker.end()
        return replace(champions, config=self._evolution.config)

    def close(self) -> None:
        """Let other processes work here."""
        self._resources.close()

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def _log(
        self,
        rows: list[HistoryRow],
        genomes: Tensor,
        fitness: Tensor,
        outcome: Outcome,
        seconds: float,
    ) -> None:
        config, generation = self.config, rows[0].generation
        failed = self._by_run(outcome.failed).squeeze(-1)
        is_plastic = config.controller == "hebbian"
        weights = [self._by_run(layer) for layer in outcome.state.weights if is_plastic]
        robot_steps = config.population * steps_in(config.duration)
        metrics = [
            measure(own, failed[run], [layer[run] for layer in weights], seconds, robot_steps)
            for run, own in enumerate(genomes)
        ]
        self.tracker.log(rows, metrics, fitness.numpy())
        if is_observed(generation, config.generations):
            champions = self._evolution.strategy.best.reshape(config.runs, -1)
            observations = self._observer(champions)
            pictured = is_filmed(generation, config.generations)
            show(self.tracker, generation, observations, self._observer.terrain, pictured)
        self.tracker.flush()

    def _by_run(self, values: Tensor) -> Tensor:
        """Values of all individuals, (runs, population, values of each), however they came."""
        return values.reshape(self.config.runs, self.config.population, -1)


def _here(config: EvolveConfig, machine: Mapping[str, Any]) -> EvolveConfig:
    """The options of a run with those of the machine that goes on with it.

    Raises:
        ValueError: it cannot.
    """
    here = replace(config, **machine)
    try:
        here.validate()
    except ValueError as error:
        raise ValueError(
            f"{error}; a run goes on elsewhere with --device and --threads of its own"
        ) from error
    return here
