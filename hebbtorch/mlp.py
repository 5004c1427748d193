"""Multi-layer perceptrons with plastic synapses (paper, Sec. III-B)."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from itertools import pairwise

import torch
from torch import Tensor, nn

from hebbtorch.genome import Evolvable, check_population, check_sizes
from hebbtorch.linear import HebbianLinear
from hebbtorch.rule_bank import ETA, TERMS, RuleBank
from hebbtorch.sampling import Generators
from hebbtorch.state import State, check_state


class HebbianMLP(Evolvable):
    """Layers of plastic synapses; tanh on every neuron but the inputs, no biases.

    In one step all layers first compute their activations under the present weights, then all
    update from those same activations; the output is the one computed before the update.

    The rules are parameters: run under `torch.no_grad()` unless you want their gradients, for
    autograd otherwise remembers every step since the state was made or detached.

    Args:
        sizes: neurons per layer, [in, hidden..., out].
        sharing: which synapses share a rule, see `hebbtorch.sharing`; "single" is one rule for
            the whole network.
        groups: with sharing="grouped", one label per input: one rule per distinct label for the
            synapses that leave the inputs, and one rule for each other layer.
        eta: learning rate; or "evolved", one gene per rule, eta = 0.01 * 10**gene.
        normalize: None; "l2": incoming weights are divided by their norm after each update; or
            "minmax": they are mapped onto [-1, 1].
        terms: which terms of the rules exist, such as "BCD" without A; the others have no genes
            and are zero.
        exchange_bc: True lets B weigh the post- and C the pre-synaptic activation, as the paper's
            own code does; Eq. (3) has them the other way round.
        constant_last_input: True replaces the last input by 1, a bias for the first layer, as
            the paper's own code does.
        population: P, dimensions of the population.
        dtype: of the coefficients and the weights; None for torch's default.
        device: where they live; None for torch's default.

    Attributes:
        layers: the `HebbianLinear`s, from the inputs on.

    Raises:
        ValueError: an argument that is not as said here.
    """

    def __init__(
        self,
        sizes: Sequence[int],
        *,
        sharing: str = "full",
        groups: Sequence[Hashable] | None = None,
        eta: float | str = ETA,
        normalize: str | None = None,
        terms: str = TERMS,
        exchange_bc: bool = False,
        constant_last_input: bool = False,
        population: Sequence[int] = (),
        dtype: torch.dtype | None = None,
        device: torch.device | str | None = None,
    ) -> None:
        super().__init__()
        self.sizes = check_sizes(sizes)
        self.population = check_population(population)
        self.constant_last_input = constant_last_input

        def layer(
            n_in: int, n_out: int, sharing: str, groups: Sequence[Hashable] | None = None
        ) -> HebbianLinear:
            return HebbianLinear(
                n_in,
                n_out,
                sharing=sharing,
                groups=groups,
                eta=eta,
                normalize=normalize,
                terms=terms,
                exchange_bc=exchange_bc,
                population=self.population,
                dtype=dtype,
                device=device,
            )

        first, *others = pairwise(self.sizes)
        sharing_of_others = "single" if sharing == "grouped" else sharing
        self.layers: Sequence[HebbianLinear] = nn.ModuleList(  # type: ignore[assignment]
            [layer(*first, sharing, groups), *(layer(*n, sharing_of_others) for n in others)]
        )
        if sharing == "single":
            for other in self.layers[1:]:
                other.rules = self.layers[0].rules

    def gene_parameters(self) -> list[tuple[int, str, nn.Parameter]]:
        """See `Evolvable`; a bank that layers share counts once."""
        first_layer_of: dict[RuleBank, int] = {}
        for index, layer in enumerate(self.layers):
            first_layer_of.setdefault(layer.rules, index)
        return [
            (index, name, parameter)
            for bank, index in first_layer_of.items()
            for name, parameter in bank.named_genes()
        ]

    def initial_state(
        self, init: str = "zeros", *, batch: Sequence[int] = (), generator: Generators = None
    ) -> State:
        """The state at birth; the layers draw one after the other.

        Args:
            init: "zeros" (the paper's) or "uniform", U(-1, 1).
            batch: further dimensions, to the left of the population's.
            generator: for "uniform", where the numbers come from: one generator, torch's default
                one if None, or one generator per entry of the first of the dimensions
                (*batch, *P); each entry then gets what it would get alone.

        Raises:
            ValueError: unknown `init`, or a wrong number of generators.
        """
        return State(
            tuple(
                layer.initial_weights(init, batch=batch, generator=generator)
                for layer in self.layers
            )
        )

    def forward(self, x: Tensor, state: State, plastic: bool = True) -> tuple[Tensor, State]:
        """One step of the network's life.

        Args:
            x: inputs, (*batch, *P, in).
            state: the present weights; left untouched.
            plastic: False leaves the weights as they are.

        Returns:
            y (*batch, *P, out), in [-1, 1], and the state of the next step.

        Raises:
            ValueError: shapes or dtypes that do not fit.
        """
        check_state(state, len(self.layers))
        if self.constant_last_input:
            x = torch.cat([x[..., :-1], torch.ones_like(x[..., :1])], -1)
        activations = [x]
        for layer, weights in zip(self.layers, state.weights, strict=True):
            activations.append(layer.activate(activations[-1], weights))
        y = activations[-1]
        if not plastic:
            return y, state
        updated = (
            layer.update(weights, pre, post)
            for layer, weights, (pre, post) in zip(
                self.layers, state.weights, pairwise(activations), strict=True
            )
        )
        return y, State(tuple(updated))
