"""Do the weights of champions come to rest, go round a cycle, or neither?

A champion acts on level ground without sensor noise, so that nothing but its own dynamics moves its
weights: for as long as an episode of its evolution, and then as long again, once plastic and once
with weights that stay as they are. Where learning has ended by itself, both are equally fast.
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass, replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from experiments.analysis import spectrum
from experiments.analysis.freezing import plastic_champions
from experiments.config import EvolveConfig
from experiments.io.csvfile import write_csv
from experiments.rollout.episode import Episode, start_episode
from experiments.rollout.scenarios import Scenarios
from experiments.runs.names import SETTLING
from physics import DT

__all__ = ["Settling", "describe", "observe", "write"]

_WATCHED = 20.0  # [s] at the end, step by step; half of it is the longest period that is found
_SECOND = 1.0
_AT_REST = 0.01  # of the mean size of the weights: a weight that varies by less is at rest
_REPEATS = 0.9  # least autocorrelation of a cycle


@dataclass(frozen=True)
class Settling:
    """How the weights of one champion go on once it has lived for an episode.

    Sizes of changes are means over the synapses, over the mean size of a weight.

    Attributes:
        course: "fixed point": weights vary by less than 1 %; "limit cycle": they repeat
            themselves, with an autocorrelation of 0.9 or more; "drift": they move on by more than
            they vary; else "irregular".
        change: of a weight within a second.
        variation: standard deviation of a weight over the last 20 s.
        trend: distance between a weight's means over the first and the second half of these.
        period: of the weights [s]; NaN where there is none.
        regularity: highest peak of their autocorrelation, at most 1; NaN where there is none.
        speed_plastic: in the second half of the episode, plastic [m/s].
        speed_frozen: with frozen weights.
    """

    course: str
    change: float
    variation: float
    trend: float
    period: float
    regularity: float
    speed_plastic: float
    speed_frozen: float


def write(folder: Path) -> Path:
    """Tell how the weights of a run's champions go on: settling.csv, a row for each.

    Args:
        folder: of a finished run.

    Returns:
        The file.

    Raises:
        ValueError: the run cannot be read, or its controllers are static.
    """
    champions = plastic_champions(folder)
    rows = observe(champions.config, champions.genomes)
    columns = ("run", *Settling.__dataclass_fields__)
    return write_csv(folder / SETTLING, columns, ((k, *astuple(r)) for k, r in enumerate(rows)))


@torch.no_grad()
def observe(config: EvolveConfig, genomes: Tensor) -> list[Settling]:
    """Let plastic individuals live for two episodes' lengths.

    Args:
        config: of their evolution; terrain, noise and damage are replaced.
        genomes: shape (K, G).
    """
    first, whole = config.duration, 2 * config.duration
    calm = replace(config, terrain="flat", noise=0.0, damage="none", duration=whole)
    scenarios = Scenarios.unseen("flat", [0]) * len(genomes)
    frozen = start_episode(calm, genomes, scenarios)
    frozen.run_until(first)
    frozen.freeze()
    frozen_speed = _speed(frozen, whole)
    plastic = start_episode(calm, genomes, scenarios)
    plastic.run_until(first)
    weights = _Weights(plastic, whole - min(_WATCHED, first))
    plastic_speed = _speed(plastic, whole, weights)
    step = DT * plastic.sim.control_interval
    return [
        describe(weights.of(k), step, plastic_speed[k], frozen_speed[k])
        for k in range(len(genomes))
    ]


def describe(
    weights: np.ndarray,
    step: float,
    speed_plastic: float = math.nan,
    speed_frozen: float = math.nan,
) -> Settling:
    """What a course of weights is.

    Args:
        weights: shape (T, n), one row per control step.
        step: length of a control step [s].
        speed_plastic: passed on [m/s].
        speed_frozen: passed on [m/s].
    """
    weights = weights.astype(np.float64)
    size = float(np.abs(weights).mean()) or 1.0
    second, half = max(1, round(_SECOND / step)), len(weights) // 2
    change = float(np.abs(weights[second:] - weights[:-second]).mean()) / size
    variation = float(weights.std(axis=0).mean()) / size
    halves = weights[:half].mean(axis=0) - weights[half:].mean(axis=0)
    trend = float(np.abs(halves).mean()) / size
    period, regularity = spectrum.period_of(weights, step), spectrum.regularity_of(weights)
    course = "irregular"
    if variation < _AT_REST:
        course = "fixed point"
    elif trend >= variation:
        course = "drift"
    elif regularity is not None and regularity >= _REPEATS:
        course = "limit cycle"
    period, regularity = (math.nan if each is None else each for each in (period, regularity))
    return Settling(
        course, change, variation, trend, period, regularity, speed_plastic, speed_frozen
    )


class _Weights:
    """The weights of all networks, step by step from some time on."""

    def __init__(self, episode: Episode, since: float) -> None:
        self.first_step = episode.sim.control_steps(since)
        self._rows: list[Tensor] = []

    def add(self, episode: Episode) -> None:
        """As they are now."""
        layers = [layer.flatten(1) for layer in episode.state().weights]
        self._rows.append(torch.cat(layers, 1).cpu())

    def of(self, individual: int) -> np.ndarray:
        """Shape (T, n)."""
        return torch.stack([row[individual] for row in self._rows]).numpy()


def _speed(episode: Episode, until: float, weights: _Weights | None = None) -> list[float]:
    """Mean speeds from now on up to a time [m/s], NaN where one failed."""
    sim = episode.sim
    start, time = sim.center_of_mass()[:, 0].double(), sim.time
    if weights is not None:
        episode.run(weights.first_step - episode.steps_done)
        while episode.steps_done < episode.n_steps:
            episode.run(1)
            weights.add(episode)
    episode.run_until(until)
    speed = (sim.center_of_mass()[:, 0].double() - start) / (sim.time - time)
    return torch.where(sim.failed(), torch.nan, speed).tolist()
