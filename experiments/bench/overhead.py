"""What a generation of an evolution costs besides the episodes of its robots."""

from __future__ import annotations

import statistics
import tempfile
from functools import partial
from pathlib import Path

import torch

from experiments.bench.measurement import Measurement, Stage
from experiments.bench.rates import BIPED
from experiments.bench.setting import Setting
from experiments.bench.timing import cpu_seconds
from experiments.config import EvolveConfig
from experiments.evolution import metrics
from experiments.evolution.evolve import Evolution
from experiments.rollout.episode import Outcome
from experiments.runs import history
from experiments.runs.folder import Checkpoint, RunStore
from experiments.runs.tensorboard import Tracker
from physics import steps_in

__all__ = ["PARTS", "besides_episodes", "generation_stages"]

PARTS = ("worlds and networks", "evolution", "logging")
_SHORT = 0.1  # [s], the least a life can last; it is counted with the making of the worlds


def besides_episodes(setting: Setting) -> list[Measurement]:
    """CPU time of one core that the robots of a generation do not live in."""
    what = f"a generation of {setting.runs} x {setting.population} besides the episodes"
    totals = tuple(1e3 * sum(parts) for parts in _generations(setting))
    return [Measurement(what, "ms", totals, more_is_better=False)]


def generation_stages(setting: Setting) -> list[Stage]:
    """CPU time of each part of a generation, per robot-step of the episodes."""
    robot_steps = setting.runs * setting.population * steps_in(setting.duration)
    return [
        Stage(name, 1e6 * statistics.median(samples) / robot_steps)
        for name, samples in zip(PARTS, zip(*_generations(setting), strict=True), strict=True)
    ]


def _generations(setting: Setting) -> list[tuple[float, ...]]:
    """CPU time of the PARTS of generations with very short episodes [s]."""
    config = EvolveConfig(
        shape=BIPED,
        sensors="high",
        runs=setting.runs,
        population=setting.population,
        duration=_SHORT,
        seed=setting.seed,
        threads=1,
    )
    evolution = Evolution(config)
    start = Checkpoint(generation=0, strategy=evolution.strategy.state_dict())
    with (
        tempfile.TemporaryDirectory() as folder,
        RunStore.create(Path(folder, "run"), config, start) as store,
        Tracker(store.folder, config, 1) as tracker,
    ):
        seconds = [
            _one_generation(evolution, store, tracker, start.history, generation)
            for generation in range(1, setting.repetitions + 2)
        ]
    return seconds[1:]  # the first compiles


def _one_generation(
    evolution: Evolution,
    store: RunStore,
    tracker: Tracker,
    course: history.History,
    generation: int,
) -> tuple[float, ...]:
    """CPU time of the PARTS of one generation [s]."""
    strategy, config = evolution.strategy, evolution.config
    outcomes: list[Outcome] = []

    def live() -> None:
        outcomes.append(evolution.evaluator(genomes, generation))

    def log() -> None:
        failed = outcomes[0].failed.reshape(fitness.shape)
        weights = [w.unflatten(0, fitness.shape) for w in outcomes[0].state.weights]
        rows = [
            history.HistoryRow.of(run, generation, fitness[run], 1.0) for run in range(config.runs)
        ]
        numbers = [
            metrics.measure(own, failed[run], [w[run].flatten(1) for w in weights], 1.0, 1)
            for run, own in enumerate(genomes)
        ]
        tracker.log(rows, numbers, fitness.numpy())
        tracker.flush()
        course.append(rows, store.history_file)
        store.save(Checkpoint(generation, strategy.state_dict(), course))

    asked: list[torch.Tensor] = []
    asking = cpu_seconds(lambda: asked.append(strategy.ask()))
    genomes = asked[0].reshape(config.runs, config.population, -1)
    living = cpu_seconds(live)
    fitness = outcomes[0].speed.reshape(config.runs, config.population)
    telling = cpu_seconds(partial(strategy.tell, fitness.reshape(asked[0].shape[:-1])))
    return living, asking + telling, cpu_seconds(log)
