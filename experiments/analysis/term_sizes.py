"""How much each term of the ABCD rule changes the weights (paper, Eq. 3)."""

from __future__ import annotations

from itertools import pairwise

import torch
from torch import Tensor

import hebbtorch
from hebbtorch.measures import term_sizes

__all__ = ["TermSizes"]


class TermSizes:
    """Adds up how much each term of the rule changes weights, over some control steps.

    The size of the term A of a synapse is |eta A x y|, so that all it takes are the sums of
    |x| |y|, |x| and |y| over the steps.
    """

    def __init__(self, networks: hebbtorch.HebbianMLP) -> None:
        self._networks = networks
        self._steps = 0
        self._sums: list[list[Tensor]] = [[] for _ in networks.layers]

    def add(self, activations: tuple[Tensor, ...]) -> None:
        """One step; activations per layer, the inputs first, shape (K, neurons)."""
        self._steps += 1
        for sums, (pre, post) in zip(self._sums, pairwise(activations), strict=True):
            x, y = pre.double().abs().unsqueeze(-2), post.double().abs().unsqueeze(-1)
            parts = (y * x, x, y)
            sums[:] = [a + b for a, b in zip(sums, parts, strict=True)] if sums else parts

    @torch.no_grad()
    def by_layer(self) -> list[Tensor]:
        """Sums over steps and synapses of the sizes of A, B, C and D, (K, 4) each, float64."""
        layers = zip(self._networks.layers, self._sums, strict=True)
        return [term_sizes(layer, xy, x, y, self._steps) for layer, (xy, x, y) in layers]

    def total(self) -> Tensor:
        """The same over all layers, shape (K, 4), float64."""
        return torch.stack(self.by_layer()).sum(0)
