"""RUN/life: one episode of a champion as a TensorBoard run whose steps are seconds of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from torch import Tensor

import hebbtorch
from experiments.analysis.measures import term_shares
from experiments.analysis.recorder import record
from experiments.analysis.term_sizes import TermSizes
from experiments.analysis.trajectory import Trajectory
from experiments.config import EvolveConfig
from experiments.rollout import controller
from experiments.runs.tensorboard import EventFile
from experiments.runs.tensorboard.heatmap import heat_map

__all__ = ["log_episode"]

_EVERY = 2  # control steps between two instants
_RASTER = 5.0  # [s] at the end, of which activations are shown one by one
_MOST_ROWS = 240  # of a picture: so many synapses of a layer, evenly chosen


def log_episode(folder: Path, config: EvolveConfig, genome: Tensor, seed: int = 0) -> Path:
    """Let a champion act once more, and show its weights and activations second by second.

    Args:
        folder: The folder of the TensorBoard run of its evolution; the files go into its folder
            `life`, in place of those of an earlier call.
        config: The options of its evolution.
        genome: The champion's genome, shape (G,).
        seed: The seed of terrain, sensor noise, damage and initial weights.

    Returns:
        The folder `life`.
    """
    course = record(config, genome, seed=seed, every=_EVERY, weights_every=1.0)
    with EventFile(folder / "life", part="episode") as file:
        for second in range(1, round(course.times[-1]) + 1):
            here = (course.times > second - 1) & (course.times <= second + 1e-6)
            if here.sum() > 1:
                _log_second(file, course, genome, second, here)
        _log_course(file, course)
    return folder / "life"


def _log_second(
    file: EventFile, course: Trajectory, genome: Tensor, second: int, here: np.ndarray
) -> None:
    """What happened in the second that ends now."""
    assert course.config is not None
    x, times = course.centers[here, 0], course.times[here]
    values: dict[str, float | None] = {
        "life/speed": float((x[-1] - x[0]) / (times[-1] - times[0])),
        "life/touch": float(course.touching[here].mean()),
        "life/broken": float(course.broken[here][-1].mean()),
    }
    for k, activations in enumerate(course.activations[1:]):
        file.histogram(f"life/activations/layer{k}", activations[here], second)
    if course.config.controller == "hebbian":
        index = int(np.argmin(np.abs(course.weight_times - second)))
        for k, weights in enumerate(course.weights):
            now, before, born = weights[index], weights[max(index - 1, 0)], weights[0]
            values[f"life/weight_mean_abs/layer{k}"] = float(np.abs(now).mean())
            values[f"life/change_per_second/layer{k}"] = float(np.abs(now - before).mean())
            values[f"life/drift_from_birth/layer{k}"] = float(np.abs(now - born).mean())
            file.histogram(f"life/weights/layer{k}", now, second)
        for k, shares in enumerate(_shares(course, genome, here)):
            values |= {f"life/share_{term}/layer{k}": share for term, share in shares.items()}
    file.scalars(values, second)


def _shares(course: Trajectory, genome: Tensor, here: np.ndarray) -> list[dict[str, float | None]]:
    """Shares of the terms of the rule in the changes of each layer."""
    assert course.config is not None
    network = controller.build(course.config, 1)
    if not (course.activations and isinstance(network, hebbtorch.HebbianMLP)):
        return []
    if course.config.rule != "abcd":
        return []  # it has no terms A, B, C, D
    network.set_genomes(genome[None])
    sizes = TermSizes(network)
    layers = [torch.from_numpy(layer[here]) for layer in course.activations]
    for instant in zip(*layers, strict=True):
        sizes.add(tuple(layer[None] for layer in instant))
    return [term_shares(layer[0].numpy()) for layer in sizes.by_layer()]


def _log_course(file: EventFile, course: Trajectory) -> None:
    """Pictures of the whole episode, at its last second."""
    assert course.config is not None
    end = round(course.times[-1])
    if course.config.controller == "hebbian":
        for k, weights in enumerate(course.weights):
            rows = weights.reshape(len(weights), -1).T
            chosen = np.linspace(0, len(rows) - 1, min(len(rows), _MOST_ROWS)).round().astype(int)
            words = f"layer{k}: {len(chosen)} of {len(rows)} weights (rows), {end} s (columns)"
            picture = heat_map(rows[chosen], words, course=True)
            file.image(f"life/weights_over_time/layer{k}", picture, end)
    last = course.times > course.times[-1] - _RASTER
    for k, activations in enumerate(course.activations[1:]):
        words = f"layer{k}: neurons (rows) in the last {_RASTER:g} s (columns)"
        picture = heat_map(activations[last].T, words, reach=1.0, course=True)
        file.image(f"life/activation_raster/layer{k}", picture, end)
