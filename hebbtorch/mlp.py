"""Multi-layer perceptrons with plastic synapses (paper, Sec. III-B)."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from itertools import pairwise
from typing import Any, Unpack

import torch
from torch import Tensor, nn

from hebbtorch.described import Described
from hebbtorch.functional.activation import Activation
from hebbtorch.functional.rules import LearningRule
from hebbtorch.genome import Evolvable, check_population, check_sizes
from hebbtorch.layer_options import LayerOptions
from hebbtorch.linear import HebbianLinear
from hebbtorch.neuron_rules import NeuronBank, NeuronGenes
from hebbtorch.rule_bank import ETA, TERMS
from hebbtorch.sampling import Generators, Init
from hebbtorch.state import Memory, State, batch_of, check_state, memory_of
from hebbtorch.stepping import Stepping

AnyRule = str | LearningRule | Callable[..., Tensor]


class HebbianMLP(Stepping, Described, Evolvable):
    """Layers of plastic synapses; tanh on every neuron but the inputs, unless told otherwise.

    In one step all layers compute their activations under the present weights and update from
    those same activations; the output is the one computed before the update.

    The rules are parameters: run under `torch.no_grad()` unless you want their gradients, for
    autograd otherwise remembers every step since the state was made or detached.

    >>> net = HebbianMLP([8, 8, 10], sharing="neuron", eta="evolved", population=(40,))
    >>> net.n_genes
    112
    >>> y, state = net(torch.rand(40, 8))
    >>> y, state = net(torch.rand(40, 8), state, plastic=torch.arange(40) < 20)

    Args:
        sizes: neurons per layer, [in, hidden..., out].
        rule: learning rule of all layers, see `hebbtorch.functional.rules`, or a list of one per
            layer.
        sharing: which synapses share a rule, see `hebbtorch.sharing`; "single" is one rule for
            the whole network.
        groups: One label per input, for sharing="grouped" only: one rule per distinct label for the
            synapses that leave the inputs, and one rule for each other layer.
        constant_last_input: True replaces the last input by 1, a bias for the first layer, as
            the paper's own code does.
        output_activation: The activation of the last layer; None: as the others.
        init: initial plastic weights of all layers, or a list of one per layer.
        **options: For all layers, as `HebbianLinear` has them: eta, normalize, terms, exchange_bc,
            average, every, decay, clip, trace_decay, activation, bias, fixed, population, dtype
            and device.

    Attributes:
        layers: the `HebbianLinear`s, from the inputs on.

    Raises:
        ValueError: an argument that is not as said here.
    """

    def __init__(
        self,
        sizes: Sequence[int],
        *,
        rule: AnyRule | Sequence[AnyRule] = "abcd",
        sharing: str = "full",
        groups: Sequence[Hashable] | None = None,
        constant_last_input: bool = False,
        output_activation: str | Activation | None = None,
        init: Init | Sequence[Init] = "zeros",
        **options: Unpack[LayerOptions],
    ) -> None:
        super().__init__()
        self.sizes = check_sizes(sizes)
        self.population = check_population(options.get("population", ()))
        self.constant_last_input = constant_last_input
        ends = self._layer_sizes()
        rules = _per_layer("rule", rule, len(ends))
        inits = _per_layer("init", init, len(ends))

        def layer(index: int) -> HebbianLinear:
            grouped = sharing == "grouped"
            return HebbianLinear(
                ends[index][0],
                ends[index][1],
                rule=rules[index],
                sharing="single" if grouped and index > 0 else sharing,
                groups=groups if index == 0 else None,
                output_activation=output_activation if index == len(ends) - 1 else None,
                init=inits[index],
                **options,
            )

        self.layers: Sequence[HebbianLinear] = nn.ModuleList(  # type: ignore[assignment]
            [layer(index) for index in range(len(ends))]
        )
        if sharing == "single":
            for other in self.layers[1:]:
                if other.rules.rule != self.layers[0].rules.rule:
                    raise ValueError("rule: expected one for all layers with sharing='single'")
                other.rules = self.layers[0].rules
        if sharing == "neuron":
            self._share_neurons(options)

    def _layer_sizes(self) -> list[tuple[int, int]]:
        """(in, out) of each layer of synapses."""
        return list(pairwise(self.sizes))

    def _share_neurons(self, options: LayerOptions) -> None:
        """Let the layers on both sides of a hidden layer read the same neurons' genes."""
        ends = [(layer.n_in, layer.n_out) for layer in self.layers]
        if any(left != right for (_, left), (right, _) in pairwise(ends)):
            raise ValueError("sharing: expected another one than 'neuron' for these layers")
        sizes = [ends[0][0], *(n_out for _, n_out in ends)]
        last = len(sizes) - 1
        ends_options: dict[str, Any] = {
            "eta": options.get("eta", ETA),
            "terms": options.get("terms", TERMS),
        }
        made: dict[str, Any] = {
            "population": self.population,
            "dtype": options.get("dtype"),
            "device": options.get("device"),
        }
        neurons = [
            NeuronGenes(n, outgoing=k < last, incoming=k > 0, **ends_options, **made)
            for k, n in enumerate(sizes)
        ]
        for layer, pre, post in zip(self.layers, neurons[:-1], neurons[1:], strict=True):
            layer.rules = NeuronBank(pre, post, **ends_options)

    def dynamics(self) -> dict[str, Any]:
        """See `Described`; those of the layers are with the layers."""
        return {"constant_last_input": self.constant_last_input}

    def gene_parameters(self) -> list[tuple[int, str, nn.Parameter]]:
        """See `Evolvable`; a parameter that layers share counts once."""
        genes: dict[nn.Parameter, tuple[int, str, nn.Parameter]] = {}
        for index, layer in enumerate(self.layers):
            for _, name, parameter in layer.gene_parameters():
                genes.setdefault(parameter, (index, name, parameter))
        return list(genes.values())

    def initial_state(
        self,
        init: Init | None = None,
        *,
        batch: Sequence[int] = (),
        generator: Generators = None,
    ) -> State:
        """The state in which an episode begins; the layers draw one after the other.

        Args:
            init: initial weights as in `HebbianLinear`; None: those of the network.
            batch: further dimensions, to the left of the population's.
            generator: where random numbers come from: one generator, torch's default one if
                None, or one generator per entry of the first of the dimensions (*batch, *P);
                each entry then gets what it would get alone.

        Raises:
            ValueError: unknown `init`, or a wrong number of generators.
        """
        states = [
            layer.initial_state(init, batch=batch, generator=generator) for layer in self.layers
        ]
        return _joined(states)

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
            x: inputs, (*batch, *P, in), in the network's dtype or a lower precision.
            state: the present state, left untouched; None: an episode begins.
            plastic: False leaves the weights as they are, while averages and traces go on; or
                a bool tensor (*batch, *P), who learns.
            modulation: third factor of the update, (*batch, *P); None: 1.

        Returns:
            y (*batch, *P, out) and the state of the next step.

        Raises:
            ValueError: shapes or dtypes that do not fit.
        """
        if state is None:
            state = self.initial_state(batch=batch_of(x, self.population))
        check_state(state, len(self.layers))
        if self.constant_last_input:
            x = torch.cat([x[..., :-1], torch.ones_like(x[..., :1])], -1)
        states = []
        for index, layer in enumerate(self.layers):
            x, after = layer(x, _of_layer(state, index), plastic, modulation=modulation)
            states.append(after)
        if plastic is False and not state.memory:
            return x, state
        return x, _joined(states)


def _of_layer(state: State, index: int) -> State:
    """The state of one layer."""
    memory: Memory = memory_of(state, index)
    return State((state.weights[index],), (memory,) if memory else ())


def _joined(states: Sequence[State]) -> State:
    """The state of a network from those of its layers."""
    memory = tuple(memory_of(state, 0) for state in states)
    return State(tuple(state.weights[0] for state in states), memory if any(memory) else ())


def _per_layer(name: str, value: Any, n_layers: int) -> list[Any]:
    """One value per layer, from one for all or a list of them."""
    if not isinstance(value, list | tuple):
        return [value] * n_layers
    if len(value) != n_layers:
        raise ValueError(f"{name}: expected one for all or {n_layers}, got {len(value)}")
    return list(value)
