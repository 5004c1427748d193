"""What all optimizers of genomes have in common, and one generation of Algorithm 1."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Protocol

import torch
from torch import Tensor


class AskTell(Protocol):
    """What an optimizer of genomes offers; `EvolutionStrategy` is one."""

    @property
    def best(self) -> Tensor:
        """The fittest genome of the last told population."""

    @property
    def best_fitness(self) -> Tensor:
        """Its fitness."""

    def ask(self) -> Tensor:
        """The genomes to evaluate next."""

    def tell(self, fitness: Tensor) -> None:
        """Their fitness, higher is better, NaN for a failed evaluation."""

    def state_dict(self) -> dict[str, Any]:
        """Everything needed to go on, as tensors and plain numbers."""

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Go on from there."""


def ranking(fitness: Tensor) -> list[int]:
    """Indices of the n individuals from the best to the worst; ties keep their order.

    NaN counts as worse than anything, -inf included.
    """
    values = fitness.tolist()
    return sorted(range(len(values)), key=lambda i: (math.isnan(values[i]), -values[i]))


def next_population(
    genomes: Tensor, order: list[int], n_parents: int, sigma: float, generator: torch.Generator
) -> Tensor:
    """One generation of Algorithm 1.

    Args:
        genomes: The present population, (n, G).
        order: indices of the n individuals from the best to the worst.
        n_parents: how many of the best are parents.
        sigma: standard deviation of the mutations.
        generator: source of the mutations.

    Returns:
        (n, G); the first is the best of `genomes`, unchanged.
    """
    best_first = torch.tensor(order, device="cpu")
    parents = genomes[best_first[:n_parents]]  # Algorithm 1, line 4
    mean = parents.mean(0)  # line 5
    elite = genomes[best_first[:1]]  # line 6
    noise = torch.randn(
        len(genomes) - 1, genomes.shape[1], generator=generator, dtype=torch.float64, device="cpu"
    )
    children = mean + sigma * noise.to(genomes.dtype)  # line 8
    return torch.cat([elite, children])
