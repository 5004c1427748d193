"""Pruning: which of the synapses that an episode has formed does the gait need (paper, Sec. IV-C)?

The paper speculates that the weights that diverge contribute little, and could be pruned like
those that lose a lottery. Here a champion acts once, plastic as it is; then a share of its
synapses is set to zero, the largest, the smallest or some at random, and what is left acts with
fixed weights on other unseen terrains.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from experiments.analysis.freezing import Weights, act, learn, training_and_test
from experiments.io.csvfile import labelled, write_csv
from experiments.rollout import seeds
from experiments.runs.champions import Champions
from experiments.runs.names import FREEZING_TERRAINS

__all__ = ["FRACTIONS", "KINDS", "Pruning", "order", "prune", "pruned"]

KINDS = ("largest", "smallest", "random")
FRACTIONS = tuple(tenths / 10 for tenths in range(10))


@dataclass(frozen=True)
class Pruning:
    """Speeds of pruned champions.

    Attributes:
        terrains: names of S terrains.
        speeds: [m/s], shape (runs, kinds, fractions, S), float64, by `KINDS` and `FRACTIONS`;
            NaN where the episode failed.
    """

    terrains: list[str]
    speeds: Tensor

    def write(self, out: Path) -> Path:
        """Write a CSV file: run, which, fraction, terrain, speed [m/s]."""
        runs = range(len(self.speeds))
        rows = labelled(self.speeds, runs, KINDS, FRACTIONS, self.terrains)
        return write_csv(out, ("run", "which", "fraction", "terrain", "speed"), rows)


def prune(champions: Champions, n_terrains: int = FREEZING_TERRAINS, seed: int = 0) -> Pruning:
    """Prune the weights that champions have at the end of an episode, and assess them from then on.

    Args:
        champions: plastic ones, see `freeze.plastic_champions`; shape, sensors, damage and
            duration of all episodes are those of their evolution.
        n_terrains: S, terrains on which each pruned network is assessed.
        seed: decides noise, damage, the initial weights, and what is pruned at random.

    Raises:
        ValueError: n_terrains is not a number of unseen terrains.
    """
    config = champions.config
    training, test = training_and_test(config, n_terrains, seed)
    learned = tuple(
        layer[0] for layer in learn(config, champions.genomes, [config.duration], training)
    )
    all_pruned = [
        pruned(learned, first, fraction)
        for first in (order(learned, kind, seed) for kind in KINDS)
        for fraction in FRACTIONS
    ]
    weights = tuple(torch.stack(layer) for layer in zip(*all_pruned, strict=True))
    speeds = act(config, weights, test, champions.genomes)
    speeds = speeds.unflatten(0, (len(KINDS), len(FRACTIONS)))
    return Pruning(test.names, speeds.movedim(2, 0))


def order(weights: Weights, kind: str, seed: int = 0) -> Tensor:
    """In which order the synapses of K networks are pruned.

    Args:
        weights: per layer, shape (K, out, in).
        kind: "largest" |w| of the network first, "smallest" first, or "random".
        seed: decides the random order, which differs between the networks.

    Returns:
        Indices of synapses, counted through all layers, shape (K, synapses).
    """
    synapses = _flat(weights)
    if kind == "random":
        generators = (
            torch.Generator().manual_seed(seeds.derive(seed, "pruning", k))
            for k in range(len(synapses))
        )
        return torch.stack([torch.randperm(synapses.shape[1], generator=g) for g in generators])
    return synapses.abs().argsort(dim=1, descending=kind == "largest", stable=True)


def pruned(weights: Weights, first: Tensor, fraction: float) -> Weights:
    """Weights of which a share is set to zero.

    Args:
        weights: per layer, shape (K, out, in).
        first: the order of pruning, see `order`.
        fraction: the share, within 0 to 1; rounded to whole synapses.
    """
    synapses = _flat(weights)
    kept = synapses.scatter(1, first[:, : round(fraction * synapses.shape[1])], 0.0)
    parts = kept.split([layer.shape[1] * layer.shape[2] for layer in weights], 1)
    return tuple(part.reshape(layer.shape) for part, layer in zip(parts, weights, strict=True))


def _flat(weights: Weights) -> Tensor:
    """All synapses of each of K networks, shape (K, synapses)."""
    return torch.cat([layer.flatten(1) for layer in weights], 1)
