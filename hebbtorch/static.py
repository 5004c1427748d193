"""The baseline without plasticity: the genome is the weights (paper, Sec. III-A2)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import torch
from torch import Tensor, nn

from hebbtorch.activation import check_activation, weighted_tanh
from hebbtorch.draws import Generators, check_init, redraw
from hebbtorch.genome import Evolvable, check_batch, check_population, check_sizes
from hebbtorch.state import State, check_state


class StaticMLP(Evolvable):
    """Layers of fixed synapses; tanh on every neuron but the inputs, no biases.

    It is called as `HebbianMLP` is; its state holds the weights of the genome and never changes.

    Args:
        sizes: neurons per layer, [in, hidden..., out].
        population: P, dimensions of the population.
        dtype: of the weights; None for torch's default.
        device: where they live; None for torch's default.

    Attributes:
        weights: one parameter (*P, out, in) per layer, from the inputs on.

    Raises:
        ValueError: an argument that is not as said here.
    """

    def __init__(
        self,
        sizes: Sequence[int],
        *,
        population: Sequence[int] = (),
        dtype: torch.dtype | None = None,
        device: torch.device | str | None = None,
    ) -> None:
        super().__init__()
        self.sizes = check_sizes(sizes)
        self.population = check_population(population)
        self.weights = nn.ParameterList(
            torch.empty((*self.population, n_out, n_in), dtype=dtype, device=device)
            for n_in, n_out in pairwise(self.sizes)
        )
        self.reset_parameters()

    def reset_parameters(self, generator: Generators = None) -> None:
        """Draw every gene from U(-1, 1), as Algorithm 1 does for its first population."""
        redraw(self.weights, generator)

    def gene_parameters(self) -> list[tuple[int, str, nn.Parameter]]:
        """See `Evolvable`."""
        return [(index, "weight", parameter) for index, parameter in enumerate(self.weights)]

    def initial_state(
        self, init: str = "zeros", *, batch: Sequence[int] = (), generator: Generators = None
    ) -> State:
        """The state of the whole life: a copy of the weights.

        Args:
            init: accepted for the sake of a common call; the genome is the weights.
            generator: likewise.
            batch: further dimensions, to the left of the population's.

        Raises:
            ValueError: unknown `init`, or a `batch` that is no sequence of positive sizes.
        """
        check_init(init)
        lead = check_batch(batch)
        return State(tuple(w.clone().expand(*lead, *w.shape) for w in self.weights))

    def forward(self, x: Tensor, state: State, plastic: bool = True) -> tuple[Tensor, State]:
        """One step of the network's life.

        Args:
            x: inputs, (*batch, *P, in).
            state: from `initial_state`.
            plastic: accepted for the sake of a common call; there is nothing to switch off.

        Returns:
            y (*batch, *P, out), in [-1, 1], and the same state.

        Raises:
            ValueError: shapes or dtypes that do not fit.
        """
        check_state(state, len(self.weights))
        activation = x
        for (n_in, n_out), weights in zip(pairwise(self.sizes), state.weights, strict=True):
            check_activation(activation, weights, n_in, n_out, self.population)
            activation = weighted_tanh(activation, weights)
        return activation, state
