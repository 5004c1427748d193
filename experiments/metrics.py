"""The numbers of one generation that go to TensorBoard, tag by tag."""

from __future__ import annotations

from torch import Tensor

from experiments.history import Row

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
    synapses = [layer.flatten(1).abs() for layer in weights]
    n_synapses = sum(layer.shape[1] for layer in synapses)
    return {
        "fitness/best": row.best,
        "fitness/median": row.median,
        "fitness/mean": row.mean,
        "fitness/q75": row.q75,
        "genome/spread": _spread(genomes),
        "genome/mean_size": genomes.abs().mean().item(),
        "plasticity/mean_weight": sum(layer.sum(1).mean().item() for layer in synapses)
        / n_synapses,
        "plasticity/largest_weight": max(layer.max().item() for layer in synapses),
        "physics/failed": failed.double().mean().item(),
        "time/generation": seconds,
        "time/evaluations_per_second": len(genomes) / seconds,
    }


def _spread(genomes: Tensor) -> float:
    """Mean over the genes of their standard deviation in the population (n - 1).

    ``Tensor.std`` along the first dimension takes fifteen times as long.
    """
    deviations = genomes - genomes.mean(0)
    return (deviations.square().sum(0) / (len(genomes) - 1)).sqrt().mean().item()
