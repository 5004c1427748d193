"""The numbers of one generation that go to TensorBoard, tag by tag; see docs/metrics.md."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from experiments.analysis.measures import DIVERGED
from hebbtorch.measures import weight_measures

__all__ = ["measure"]


def measure(
    genomes: Tensor,
    failed: Tensor,
    weights: Sequence[Tensor],
    seconds: float,
    robot_steps: int,
) -> dict[str, float | None]:
    """Tags and values of one run's population, besides its fitness.

    Args:
        genomes: shape (population, G).
        failed: whose world became non-finite, shape (population,).
        weights: The weights of each layer at the end of the episodes, shapes (population,
            synapses); none of static controllers, whose weights are their genomes.
        seconds: wall time of this generation [s].
        robot_steps: steps of 1/60 s that all robots of this population made.
    """
    return {
        "genome/spread": _spread(genomes),
        "genome/mean_abs": genomes.abs().mean().item(),
        **_plasticity(weights),
        "body/failed": failed.double().mean().item(),
        "time/generation": seconds,
        "time/evaluations_per_second": len(genomes) / seconds,
        "time/robot_steps_per_second": robot_steps / seconds,
    }


def _plasticity(weights: Sequence[Tensor]) -> dict[str, float]:
    """Sizes of the weights at the end, over all individuals."""
    if not weights:
        return {}
    values = {"plasticity/diverged": _diverged(torch.cat([layer.abs() for layer in weights], 1))}
    for k, layer in enumerate(weights):
        sizes = weight_measures(layer.unsqueeze(-2))
        values[f"plasticity/weight_mean_abs/layer{k}"] = sizes["weight_mean_abs"].mean().item()
        values[f"plasticity/weight_max_abs/layer{k}"] = sizes["weight_max_abs"].max().item()
    return values


def _diverged(sizes: Tensor) -> float:
    """Share of weights more than ten times as large as the median one of their network.

    Args:
        sizes: The sizes of all weights, shape (population, synapses).
    """
    return (sizes > DIVERGED * sizes.median(1, keepdim=True).values).double().mean().item()


def _spread(genomes: Tensor) -> float:
    """Mean over the genes of their standard deviation in the population (n - 1).

    ``Tensor.std`` along the first dimension takes fifteen times as long.
    """
    deviations = genomes - genomes.mean(0)
    return (deviations.square().sum(0) / (len(genomes) - 1)).sqrt().mean().item()
