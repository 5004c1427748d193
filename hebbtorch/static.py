"""The baselines without plasticity: the genome is the weights (paper, Sec. III-A2)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import torch
from torch import Tensor, nn

from hebbtorch.described import Described, option
from hebbtorch.functional.activation import (
    Activation,
    activation_named,
    fitting_input,
    weighted_sum,
)
from hebbtorch.genome import Evolvable, check_batch, check_population, check_sizes, recurrent_sizes
from hebbtorch.sampling import Generators, check_init, redraw
from hebbtorch.state import State, batch_of, check_state, memory_of
from hebbtorch.stepping import Stepping


class StaticMLP(Stepping, Described, Evolvable):
    """Layers of fixed synapses; y = f(W x + b) in each, with the weights of the genome.

    It is called as `HebbianMLP` is; its state holds the weights of the genome and never changes.

    >>> net = StaticMLP([3, 4, 2], bias=True, gain=30.0)
    >>> net.n_genes  # (3 + 1) * 4 + (4 + 1) * 2
    26
    >>> y, state = net(torch.rand(3))
    >>> bool((state.weights[0] == 30 * net.weights[0]).all())
    True

    Args:
        sizes: neurons per layer, [in, hidden..., out].
        gain: factor on every gene, biases included, where it becomes a weight.
        bias: whether every neuron but the inputs has a bias, a gene of its own.
        activation: The activation of every neuron but the inputs: "tanh", "identity" and others of
            `hebbtorch.functional.activation.ACTIVATIONS`, or an elementwise callable.
        output_activation: The activation of the last layer; None: as the others.
        input_activation: The activation of the inputs; the paper's own code has "tanh" here.
        population: P, dimensions of the population.
        dtype: The data type of the weights; None for torch's default.
        device: where they live; None for torch's default.

    Attributes:
        weights: one parameter (*P, out, in) of genes per layer, from the inputs on.
        biases: one parameter (*P, out, 1) of genes per layer, if `bias`.

    Raises:
        ValueError: an argument that is not as said here.
    """

    def __init__(
        self,
        sizes: Sequence[int],
        *,
        gain: float = 1.0,
        bias: bool = False,
        activation: str | Activation = "tanh",
        output_activation: str | Activation | None = None,
        input_activation: str | Activation = "identity",
        population: Sequence[int] = (),
        dtype: torch.dtype | None = None,
        device: torch.device | str | None = None,
    ) -> None:
        super().__init__()
        self.sizes = check_sizes(sizes)
        self.population = check_population(population)
        if not (isinstance(gain, int | float) and math.isfinite(gain)):
            raise ValueError(f"gain: expected a finite number, got {gain!r}")
        self.gain = float(gain)
        self.activation = activation
        self.output_activation = activation if output_activation is None else output_activation
        self.input_activation = input_activation
        hidden = activation_named(activation)
        last = activation_named(self.output_activation, "output_activation")
        self._input = activation_named(input_activation, "input_activation")
        self._activations = [hidden] * (len(self.sizes) - 2) + [last]
        shapes = [(n_out, n_in) for n_in, n_out in self._layer_sizes()]
        self.weights = nn.ParameterList(
            torch.empty((*self.population, *shape), dtype=dtype, device=device) for shape in shapes
        )
        self.biases = nn.ParameterList(
            torch.empty((*self.population, n_out, 1), dtype=dtype, device=device)
            for n_out, _ in (shapes if bias else [])
        )
        self.reset_parameters()

    def _layer_sizes(self) -> list[tuple[int, int]]:
        """(in, out) of each layer of weights."""
        return list(pairwise(self.sizes))

    def dynamics(self) -> dict[str, Any]:
        """See `Described`."""
        names = ("gain", "activation", "output_activation", "input_activation")
        return {name: option(getattr(self, name)) for name in names}

    def reset_parameters(self, generator: Generators = None) -> None:
        """Draw every gene from U(-1, 1), as Algorithm 1 does for its first population."""
        redraw((parameter for _, _, parameter in self.gene_parameters()), generator)

    def gene_parameters(self) -> list[tuple[int, str, nn.Parameter]]:
        """See `Evolvable`; layer by layer the weights and then, if any, the biases."""
        genes = []
        for index, weight in enumerate(self.weights):
            genes.append((index, "weight", weight))
            if self.biases:
                genes.append((index, "bias", self.biases[index]))
        return genes

    def initial_state(
        self, init: str | None = None, *, batch: Sequence[int] = (), generator: Generators = None
    ) -> State:
        """The state of the whole life: the weights, gain times the genes.

        Args:
            init: accepted for the sake of a common call; the genome is the weights.
            generator: Accepted for the same reason; nothing is drawn.
            batch: further dimensions, to the left of the population's.

        Raises:
            ValueError: unknown `init`, or a `batch` that is no sequence of positive sizes.
        """
        check_init("zeros" if init is None else init)
        lead = check_batch(batch)
        weights = (w.clone() if self.gain == 1.0 else self.gain * w for w in self.weights)
        return State(tuple(w.expand(*lead, *w.shape) for w in weights))

    def forward(
        self,
        x: Tensor,
        state: State | None = None,
        plastic: bool | Tensor = True,
        *,
        modulation: Tensor | None = None,
    ) -> tuple[Tensor, State]:
        """One step of the network's life.

        Args:
            x: inputs, (*batch, *P, in).
            state: What `initial_state` gave; None: a lifetime begins.
            plastic: accepted for the sake of a common call; there is nothing to switch off.
            modulation: Accepted for the same reason; nothing is modulated.

        Returns:
            y (*batch, *P, out) and the same state.

        Raises:
            ValueError: shapes or dtypes that do not fit.
        """
        if state is None:
            state = self.initial_state(batch=batch_of(x, self.population))
        check_state(state, len(self.weights))
        activation = self._input(x)
        for layer in range(len(self.weights)):
            activation = self._activate(layer, activation, state)
        return activation, state

    def _activate(self, layer: int, x: Tensor, state: State) -> Tensor:
        """Activations of one layer's neurons, (*batch, *P, out)."""
        n_in, n_out = self._layer_sizes()[layer]
        weights = state.weights[layer]
        x = fitting_input(x, weights, n_in, n_out, self.population)
        bias = None
        if self.biases:
            bias = self.gain * self.biases[layer]
        return self._activations[layer](weighted_sum(x, weights, bias))


class StaticRNN(StaticMLP):
    """An Elman network with fixed synapses: its hidden neurons also see their last activations.

    h_t = f(W_h [x_t, h_{t-1}] + b_h), y_t = g(W_y h_t + b_y), h_0 = 0. Its weights are the
    genome; the hidden activations are the `memory` of its state.

    >>> net = StaticRNN([8, StaticRNN.largest_hidden(8, 10, n_genes=576), 10], gain=30.0)
    >>> net.sizes, net.n_genes
    ((8, 16, 10), 544)

    Source: Elman, "Finding structure in time", Cognitive Science 14 (1990).

    Args:
        sizes: [in, hidden, out].
        gain: as in `StaticMLP`, and so are the other arguments.
        bias: see there.
        activation: The activation of the hidden neurons.
        output_activation: The activation of the outputs; None: as the hidden ones.
        input_activation: The activation of the inputs.
        population: P, dimensions of the population.
        dtype: The data type of the weights; None for torch's default.
        device: where they live; None for torch's default.

    Raises:
        ValueError: an argument that is not as said here.
    """

    @staticmethod
    def largest_hidden(n_in: int, n_out: int, n_genes: int, *, bias: bool = False) -> int:
        """The most hidden neurons with which a network has at most `n_genes` genes.

        Raises:
            ValueError: not even one hidden neuron has so few.
        """
        hidden = 0
        while _genes(n_in, hidden + 1, n_out, bias) <= n_genes:
            hidden += 1
        if hidden == 0:
            raise ValueError(
                f"n_genes: expected at least {_genes(n_in, 1, n_out, bias)}, those of one hidden "
                f"neuron between {n_in} inputs and {n_out} outputs, got {n_genes!r}"
            )
        return hidden

    def _layer_sizes(self) -> list[tuple[int, int]]:
        return recurrent_sizes(self.sizes)

    def initial_state(
        self, init: str | None = None, *, batch: Sequence[int] = (), generator: Generators = None
    ) -> State:
        """As in `StaticMLP`; the hidden activations are zero."""
        weights = super().initial_state(init, batch=batch, generator=generator).weights
        hidden = weights[0].new_zeros(*weights[0].shape[:-2], 1, self.sizes[1])
        return State(weights, ({"hidden": hidden}, {}))

    def forward(
        self,
        x: Tensor,
        state: State | None = None,
        plastic: bool | Tensor = True,
        *,
        modulation: Tensor | None = None,
    ) -> tuple[Tensor, State]:
        """As in `StaticMLP`; the state that it returns has the new hidden activations."""
        if state is None:
            state = self.initial_state(batch=batch_of(x, self.population))
        check_state(state, len(self.weights))
        before = memory_of(state, 0)["hidden"].squeeze(-2)
        seen = torch.cat([self._input(x).to(before.dtype), before], -1)
        hidden = self._activate(0, seen, state)
        y = self._activate(1, hidden, state)
        return y, State(state.weights, ({"hidden": hidden.unsqueeze(-2)}, {}))


def _genes(n_in: int, hidden: int, n_out: int, bias: bool) -> int:
    """Genes of a recurrent network with so many hidden neurons."""
    return hidden * (n_in + hidden) + n_out * hidden + (hidden + n_out) * bias
