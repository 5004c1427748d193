"""The numbers of one generation that go to TensorBoard, tag by tag."""

from __future__ import annotations

import torch
from torch import Tensor

from experiments.analysis.measures import DIVERGED
from experiments.runs.history import Row

__all__ = ["measure"]


def measure(
    row: Row, genomes: Tensor, failed: Tensor, weights: list[Tensor], seconds: float
) -> dict[str, float]:
    """Tags and values of one run's population.

    Args:
        row: its fitness.
        genomes: shape (population, G).
        failed: whose world became non-finite, shape (population,).
        weights: of each layer at the end of the lives, shapes (population, out, in).
        seconds: wall time of this generation [s].
    """
    sizes = torch.cat([layer.flatten(1) for layer in weights], 1).abs()
    return {
        "fitness/best": row.best,
        "fitness/median": row.median,
        "fitness/mean": row.mean,
        "fitness/q75": row.q75,
        "genome/spread": _spread(genomes),
        "genome/mean_size": genomes.abs().mean().item(),
        "plasticity/mean_weight": sizes.mean().item(),
        "plasticity/largest_weight": sizes.max().item(),
        "plasticity/diverged": _diverged(sizes),
        "physics/failed": failed.double().mean().item(),
        "time/generation": seconds,
        "time/evaluations_per_second": len(genomes) / seconds,
    }


def _diverged(sizes: Tensor) -> float:
    """Share of weights more than ten times as large as the median one of their network.

    Args:
        sizes: of all weights, shape (population, synapses).
    """
    return (sizes > DIVERGED * sizes.median(1, keepdim=True).values).double().mean().item()


def _spread(genomes: Tensor) -> float:
    """Mean over the genes of their standard deviation in the population (n - 1).

    ``Tensor.std`` along the first dimension takes fifteen times as long.
    """
    deviations = genomes - genomes.mean(0)
    return (deviations.square().sum(0) / (len(genomes) - 1)).sqrt().mean().item()
