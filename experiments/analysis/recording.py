"""What goes on within plastic champions during an episode (paper, Sec. IV-C, Fig. 7 and 9).

Each champion acts once on an unseen terrain while its weights, its neurons and its body are
recorded. A run's folder gets two files:

- recording.json: per run, how the weights, the neurons and the changes of weights are.
- recording.npz: what they are computed from; see `Recording`.
"""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

import hebbtorch
from experiments.analysis import measures
from experiments.analysis.freezing import plastic_champions, training_and_test
from experiments.analysis.term_sizes import TermSizes
from experiments.config import EvolveConfig
from experiments.io.atomic import write_atomically
from experiments.rollout import fused
from experiments.rollout.episode import start_episode
from experiments.rollout.scenarios import Scenarios
from experiments.runs.names import (
    RANDOM_GENOMES,
    RECORDING,
    RECORDING_FORMAT,
    RECORDING_MEASURES,
)
from physics import DT, Simulator

__all__ = [
    "Recording",
    "describe",
    "observe",
    "times_of",
    "write",
    "write_random",
]

LAYERS = ("hidden", "output")
_TIMES = (1 / 60, 1 / 4, 1.0)  # of an episode: 1, 15 and 60 s of the paper's
_LAST = 10.0  # [s] that are kept step by step
_AVERAGED = 1.0  # [s] over which the changes of weights are averaged
_BINS = 40  # of the histograms of activations, from -1 to 1


@dataclass(frozen=True)
class Recording:
    """The episodes of K champions; T control steps, of which the last L are kept in detail.

    Attributes:
        times: The times at which the weights were taken [s].
        weights: per layer, shape (K, times, out, in), float32.
        histograms: The histograms of the activations over the whole episode, shape (K, layers, 40),
            counts in equal bins from -1 to 1; layers are the hidden and the output one.
        activations: per layer, shape (K, L, neurons), float16.
        areas: The areas of the voxels over those at rest, shape (K, L, V), float16.
        touching: whether the voxels touch the ground, shape (K, L, V), bool.
        way: The path of the robot's centre [m], shape (K, T, 2), float32.
        terms: summed sizes of the terms A, B, C, D of all changes of weights in the second that
            ends at each of the times, shape (K, times, 4), float64.
        step: length of a control step [s].
    """

    times: list[float]
    weights: tuple[np.ndarray, ...]
    histograms: np.ndarray
    activations: tuple[np.ndarray, ...]
    areas: np.ndarray
    touching: np.ndarray
    way: np.ndarray
    terms: np.ndarray
    step: float = DT

    def synapses(self, run: int, k: int) -> np.ndarray:
        """All weights of one champion at the k-th of the times, shape (n,)."""
        return np.concatenate([layer[run, k].ravel() for layer in self.weights])

    def to_npz(self) -> bytes:
        """Content of a file for `numpy.load`, compressed: times, weights_0 and weights_1 (the
        first layer's leave the inputs), activations_hidden and activations_output, and the rest
        by the names that they have here."""
        arrays: dict[str, Any] = {
            "format": np.array(RECORDING_FORMAT),
            "times": np.array(self.times),
            "histograms": self.histograms,
            "areas": self.areas,
            "touching": self.touching,
            "way": self.way,
            "terms": self.terms,
            "step": np.array(self.step),
        }
        arrays |= {f"weights_{k}": layer for k, layer in enumerate(self.weights)}
        arrays |= {
            f"activations_{name}": layer
            for name, layer in zip(LAYERS, self.activations, strict=True)
        }
        content = io.BytesIO()
        np.savez_compressed(content, **arrays)
        return content.getvalue()


def times_of(duration: float) -> list[float]:
    """When weights are looked at [s]: at 1/60, at a quarter and at the end of an episode."""
    return [share * duration for share in _TIMES]


def write(folder: Path, seed: int = 0) -> Path:
    """Observe the champions of a run and write both files into its folder.

    Args:
        folder: The folder of the run.
        seed: decides noise, damage and the initial weights.

    Returns:
        The file recording.json, written last.

    Raises:
        ValueError: the run cannot be read, or its controllers are static.
    """
    champions = plastic_champions(folder)
    config = champions.config
    training, _ = training_and_test(config, 1, seed)
    recording = observe(config, champions.genomes, training)
    write_atomically(folder / RECORDING, recording.to_npz())
    return _write_summary(folder / RECORDING_MEASURES, config, training, recording)


def write_random(folder: Path, seed: int = 0) -> Path:
    """Observe random individuals where the champions of a run were observed: what no evolution
    brought about shows in them as well.

    They are the first population of the run's evolution (of its first run, if it has several).

    Args:
        folder: The folder of the run.
        seed: decides noise, damage and the initial weights.

    Returns:
        The file random_genomes.json, like recording.json.

    Raises:
        ValueError: the run cannot be read, or its controllers are static.
    """
    champions = plastic_champions(folder)
    config = champions.config
    training, _ = training_and_test(config, 1, seed)
    strategy = hebbtorch.EvolutionStrategy(
        champions.genomes.shape[1], population=config.population, seed=config.seed
    )
    recording = observe(config, strategy.ask(), training)
    return _write_summary(folder / RANDOM_GENOMES, config, training, recording)


def _write_summary(
    path: Path, config: EvolveConfig, training: Scenarios, recording: Recording
) -> Path:
    summary = {
        "format": RECORDING_FORMAT,
        "terrain": training.names[0],
        "damage": config.damage,
        "duration": config.duration,
        "runs": describe(recording),
    }
    write_atomically(path, (json.dumps(summary, indent=1, allow_nan=False) + "\n").encode())
    return path


@torch.no_grad()
def observe(config: EvolveConfig, genomes: Tensor, training: Scenarios) -> Recording:
    """Let plastic individuals live, and record their weights, neurons and bodies.

    Args:
        config: The options of their evolution.
        genomes: shape (K, G).
        training: the one scenario that all of them meet.
    """
    config = replace(config, loop="fused")  # whose activations can be read
    episode = start_episode(config, genomes, training * len(genomes))
    assert isinstance(episode.network, hebbtorch.HebbianMLP)
    assert isinstance(episode.loop, fused.FusedLoop)
    recorder = _Recorder(episode.network, episode.sim, config.duration)
    for _ in range(episode.n_steps):
        episode.run(1)
        recorder.add(episode.sim, episode.loop)
    return recorder.recording()


class _Recorder:
    """Takes down K episodes step by step; see `Recording`."""

    def __init__(self, networks: hebbtorch.HebbianMLP, sim: Simulator, duration: float) -> None:
        self.n_steps = sim.control_steps(duration)
        self._times = times_of(duration)
        self._ends = [max(1, sim.control_steps(time)) for time in self._times]
        self._first_kept = max(1, self.n_steps - sim.control_steps(_LAST) + 1)
        self._step = 0
        self._averaged = sim.control_steps(_AVERAGED)
        self._step_length = DT * sim.control_interval
        self._changes = [TermSizes(networks) for _ in self._times]
        self._weights: list[tuple[Tensor, ...]] = []
        self._histograms = np.zeros((*networks.population, len(LAYERS), _BINS), dtype=np.int64)
        self._neurons: list[tuple[Tensor, ...]] = []
        self._areas: list[Tensor] = []
        self._touching: list[Tensor] = []
        self._way: list[Tensor] = []

    def add(self, sim: Simulator, loop: fused.FusedLoop) -> None:
        """What there is to see after one more control step."""
        self._step += 1
        activations = loop.activations()
        neurons = activations[1:]
        self._way.append(sim.center_of_mass())
        for layer, values in enumerate(neurons):
            _count(self._histograms[:, layer], values.cpu().numpy())
        for end, change in zip(self._ends, self._changes, strict=True):
            if end - self._averaged < self._step <= end:
                change.add(activations)
            if end == self._step:
                self._weights.append(loop.state().weights)
        if self._step >= self._first_kept:
            self._neurons.append(neurons)
            self._areas.append(sim.area_ratios())
            self._touching.append(sim.touching())

    def recording(self) -> Recording:
        """All of it."""
        return Recording(
            times=self._times,
            weights=tuple(_stack(layer) for layer in zip(*self._weights, strict=True)),
            histograms=self._histograms,
            activations=tuple(
                _stack(layer).astype(np.float16) for layer in zip(*self._neurons, strict=True)
            ),
            areas=_stack(self._areas).astype(np.float16),
            touching=_stack(self._touching),
            way=_stack(self._way).astype(np.float32),
            terms=_stack([change.total() for change in self._changes]),
            step=self._step_length,
        )


def describe(recording: Recording) -> list[dict[str, Any]]:
    """The measures of each of the K episodes, ready for JSON; see `dynamics` for what they are."""
    runs = []
    for run in range(len(recording.way)):
        at_times = [
            {
                "second": time,
                **measures.weight_measures(recording.synapses(run, k)),
                "terms": measures.term_shares(recording.terms[run, k]),
            }
            for k, time in enumerate(recording.times)
        ]
        layers = {
            name: measures.activation_measures(values[run], recording.step)
            for name, values in zip(LAYERS, recording.activations, strict=True)
        }
        runs.append(
            {
                "run": run,
                "weights": at_times,
                "layers": layers,
                **measures.gait_measures(recording.areas[run], recording.step),
            }
        )
    return runs


def _stack(moments: Sequence[Tensor]) -> np.ndarray:
    """Values (K, ...) of several moments as (K, moments, ...)."""
    return torch.stack(tuple(moments), 1).cpu().numpy()


def _count(histograms: np.ndarray, values: np.ndarray) -> None:
    """Add values (K, neurons) to the counts (K, bins)."""
    bins = np.clip(((np.nan_to_num(values) + 1) / 2 * _BINS).astype(int), 0, _BINS - 1)
    for counts, own in zip(histograms, bins, strict=True):
        counts += np.bincount(own, minlength=_BINS)
