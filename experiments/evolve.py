"""Evolution from the first generation to the film of the champion, resumable at any moment."""

from __future__ import annotations

import time
from pathlib import Path

from torch import Tensor

import hebbtorch
from experiments import film
from experiments.champion import Champions
from experiments.config import EvolveConfig
from experiments.episode import Life
from experiments.evaluate import Evaluator
from experiments.history import Row
from experiments.metrics import measure
from experiments.progress import ProgressDisplay
from experiments.store import Checkpoint, RunStore
from experiments.tracker import Tracker

__all__ = ["evolve", "resume"]


def evolve(config: EvolveConfig, folder: Path) -> None:
    """Run an evolution and leave everything in a new folder.

    Args:
        config: the options.
        folder: must not exist yet, or be empty.

    Raises:
        ValueError: an option is wrong, or the folder cannot be used; nothing was written then.
        KeyboardInterrupt: it was stopped; `resume` goes on with it.
    """
    config.validate()
    evolution = Evolution(config)
    start = Checkpoint(generation=0, strategy=evolution.strategy.state_dict())
    with RunStore.create(folder, config, start) as store:
        evolution.run(store, start)


def resume(folder: Path) -> None:
    """Go on with an evolution exactly as if it had not been stopped.

    Args:
        folder: of the run.

    Raises:
        ValueError: the folder cannot be used; nothing was changed then.
        KeyboardInterrupt: it was stopped again.
    """
    store, checkpoint = RunStore.resume(folder)
    with store:
        evolution = Evolution(store.config)
        evolution.strategy.load_state_dict(checkpoint.strategy)
        evolution.run(store, checkpoint)


class Evolution:
    """The strategy and the evaluation of one evolution."""

    def __init__(self, config: EvolveConfig) -> None:
        self.config = config
        self.evaluator = Evaluator(config)
        self.strategy = hebbtorch.EvolutionStrategy(
            self.evaluator.n_genes,
            population=config.population,
            sigma=config.sigma,
            runs=config.runs,
            seed=config.seed,
        )

    def run(self, store: RunStore, checkpoint: Checkpoint) -> None:
        """Evolve from a checkpoint to the last generation, then present the champions."""
        config, done = self.config, checkpoint.generation
        with Tracker(store.folder, config, done + 1) as tracker:
            try:
                self._evolve(store, checkpoint, tracker)
                self._present(store.folder, tracker)
            except KeyboardInterrupt:
                print(f"stopped; go on with: hebbtorch evolve --resume {store.folder}")
                raise

    def _evolve(self, store: RunStore, checkpoint: Checkpoint, tracker: Tracker) -> None:
        config, done, history = self.config, checkpoint.generation, checkpoint.history
        seconds_before, started = history.seconds, time.perf_counter()
        with ProgressDisplay(config.generations, done) as progress:
            for generation in range(done + 1, config.generations + 1):
                generation_started = time.perf_counter()
                genomes = self.strategy.ask()
                life = self.evaluator(self._by_run(genomes), generation)
                fitness = self._by_run(life.speed.cpu())
                self.strategy.tell(fitness.reshape(genomes.shape[:-1]))
                now = time.perf_counter()
                rows = [
                    Row.of(run, generation, fitness[run], seconds_before + now - started)
                    for run in range(config.runs)
                ]
                self._log(tracker, rows, self._by_run(genomes), life, now - generation_started)
                # In this order, whatever a kill leaves behind is no older than the checkpoint.
                history.append(rows, store.history_file)
                store.save(Checkpoint(generation, self.strategy.state_dict(), history))
                n_evaluations = config.runs * config.population
                progress.show(rows, n_evaluations / (now - generation_started))

    def _log(
        self, tracker: Tracker, rows: list[Row], genomes: Tensor, life: Life, seconds: float
    ) -> None:
        failed = self._by_run(life.failed)
        weights = [self._by_run(layer) for layer in life.state.weights]
        metrics = [
            measure(row, genomes[run], failed[run], [layer[run] for layer in weights], seconds)
            for run, row in enumerate(rows)
        ]
        tracker.log(rows[0].generation, metrics)
        tracker.flush()

    def _present(self, folder: Path, tracker: Tracker) -> None:
        strategy, runs = self.strategy, self.config.runs
        champions = Champions(
            self.config, strategy.best.reshape(runs, -1), strategy.best_fitness.reshape(runs)
        )
        files = [champions.save(folder)]
        for run, speed in enumerate(champions.fitness.tolist()):
            print(f"champion of run {run}: {speed:.2f} m/s")
        pictures = film.film_run(folder, run=champions.best_run, mp4=False)  # `render` makes one
        tracker.show(champions.best_run, self.config.generations, pictures)
        for path in (*files, *pictures):
            print(f"wrote {path}")
        print(f"see the curves with: tensorboard --logdir {folder}")

    def _by_run(self, values: Tensor) -> Tensor:
        """Values of all individuals, (runs, population, ...), however they came."""
        config = self.config
        individuals = values.reshape(config.runs * config.population, -1).squeeze(-1)
        return individuals.unflatten(0, (config.runs, config.population))
