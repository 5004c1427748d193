"""A plastic Elman network."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from hebbtorch.genome import recurrent_sizes
from hebbtorch.mlp import HebbianMLP
from hebbtorch.sampling import Generators, Init
from hebbtorch.state import State, batch_of, check_state


class HebbianRNN(HebbianMLP):
    """An Elman network whose synapses are plastic, the recurrent ones too.

    h_t = f(W_h [x_t, h_{t-1}]), y_t = g(W_y h_t), h_0 = 0; the rule of a recurrent synapse sees
    h_{t-1} before and h_t after it. `StaticRNN` is the baseline whose weights are the genome.

    >>> net = HebbianRNN([3, 5, 2])
    >>> y, state = net(torch.rand(3))
    >>> [tuple(w.shape) for w in state.weights], tuple(state.memory[0]["hidden"].shape)
    ([(5, 8), (2, 5)], (1, 5))

    Source: Elman, "Finding structure in time", Cognitive Science 14 (1990).

    Its sizes are [in, hidden, out], its further arguments those of `HebbianMLP`; for "grouped" give
    a label to each input and then to each hidden neuron. "neuron" is not for recurrent networks.

    Raises:
        ValueError: an argument that is not as said here.
    """

    def _layer_sizes(self) -> list[tuple[int, int]]:
        return recurrent_sizes(self.sizes)

    def initial_state(
        self,
        init: Init | None = None,
        *,
        batch: Sequence[int] = (),
        generator: Generators = None,
    ) -> State:
        """As in `HebbianMLP`; the hidden activations are zero."""
        state = super().initial_state(init, batch=batch, generator=generator)
        weights = state.weights[0].detach()
        hidden = weights.new_zeros(*weights.shape[:-2], 1, self.sizes[1])
        first, second = state.memory or ({}, {})
        return State(state.weights, ({**first, "hidden": hidden}, second))

    def forward(
        self,
        x: Tensor,
        state: State | None = None,
        plastic: bool | Tensor = True,
        *,
        modulation: Tensor | None = None,
    ) -> tuple[Tensor, State]:
        """As in `HebbianMLP`; the state that it returns has the new hidden activations."""
        if state is None:
            state = self.initial_state(batch=batch_of(x, self.population))
        check_state(state, len(self.layers))
        if self.constant_last_input:
            x = torch.cat([x[..., :-1], torch.ones_like(x[..., :1])], -1)
        first, second = state.memory
        before = first["hidden"].squeeze(-2)
        seen = torch.cat([x.to(before.dtype), before], -1)
        one = State(state.weights[:1], (first,))
        other = State(state.weights[1:], (second,) if second else ())
        hidden, one = self.layers[0](seen, one, plastic, modulation=modulation)
        y, other = self.layers[1](hidden, other, plastic, modulation=modulation)
        now = {**one.memory[0], "hidden": hidden.unsqueeze(-2)}
        return y, State((*one.weights, *other.weights), (now, *(other.memory or ({},))))
