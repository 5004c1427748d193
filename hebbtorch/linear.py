"""One layer of plastic synapses."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from typing import Any, Self

import torch
from torch import Tensor, nn

from hebbtorch.described import Described, option
from hebbtorch.functional.activation import (
    Activation,
    activation_named,
    fitting_input,
    weighted_sum,
)
from hebbtorch.functional.bounds import Bound, bound_named
from hebbtorch.functional.rules import RULES, LearningRule, Rule, rule_named
from hebbtorch.genome import Evolvable, check_batch, check_population, check_sizes
from hebbtorch.neuron_rules import NeuronBank, NeuronGenes, check_neuron_rule
from hebbtorch.plasticity import Plasticity
from hebbtorch.rule_bank import ETA, TERMS, Bank, RuleBank
from hebbtorch.sampling import Generators, Init, check_init, draw_weights, redraw
from hebbtorch.sharing import rule_grid
from hebbtorch.state import Memory, State, batch_of, check_state, memory_of
from hebbtorch.stepping import Stepping


class HebbianLinear(Stepping, Described, Evolvable):
    """Plastic synapses from `n_in` to `n_out` neurons: y = f(W x + b), then W changes.

    The plastic weights are state, not parameters: see `initial_state` and `forward`. Any
    dimensions to the left of the population's are batch: several lifetimes under the same rules.

    >>> layer = HebbianLinear(3, 1, rule="oja", activation="identity", eta=0.1)
    >>> x, state = torch.tensor([0.6, 0.0, 0.8]), layer.initial_state("uniform")
    >>> with torch.no_grad():
    ...     for _ in range(500):
    ...         y, state = layer(x, state)
    >>> [round(abs(w), 4) for w in state.weights[0][0].tolist()]  # x itself: it has norm 1
    [0.6, 0.0, 0.8]

    With `fixed=True` it has genes for weights that are not plastic and for how much the plastic
    ones count, here 3 of each besides A, B, C and D:

    >>> HebbianLinear(3, 1, fixed=True).n_genes
    18

    Args:
        n_in: number of pre-synaptic neurons.
        n_out: number of post-synaptic neurons.
        rule: "abcd" (the paper's), "hebb", "oja", "bcm", "differential" or a rule of one's own,
            see `hebbtorch.functional.rules`.
        sharing: which synapses share a rule, see `hebbtorch.sharing`.
        groups: One label per input, for sharing="grouped" only.
        eta: learning rate; or "evolved", one gene per rule, eta = 0.01 * 10**gene.
        normalize: What is done to the weights after each update: None; "l2", each neuron's incoming
            weights over their norm; "minmax", mapped onto [-1, 1]; "max", the layer's over the
            greatest |w|; or a function of the weights.
        terms: which terms of the ABCD rule exist, such as "BCD" without A; the others have no
            genes and are zero.
        exchange_bc: True lets B weigh the post- and C the pre-synaptic activation, as the paper's
            own code does; Eq. (3) has them the other way round.
        average: M, the rule sees the means of the activations over the last M steps.
        every: K, the weights change in steps K, 2 K, ... of a life.
        decay: share of the weights that is lost in each update; not multiplied by eta.
        clip: bound on |w|, or None.
        trace_decay: share of the eligibility trace that stays from update to update: e <-
            trace_decay e + dw, w <- w + modulation e.
        activation: The activation of the post-synaptic neurons: "tanh", "identity" and others of
            `hebbtorch.functional.activation.ACTIVATIONS`, or an elementwise callable.
        output_activation: the same, for a common call with `HebbianMLP`; it wins.
        bias: whether the neurons have a bias: a gene each, not plastic.
        fixed: True adds weights that are not plastic: W = fixed + alpha * plastic weights, where
            `fixed` and `alpha` are parameters and genes (Miconi et al. 2018, arXiv 1804.02464).
        init: initial plastic weights: "zeros", "uniform" U(-1, 1), "normal" N(0, 1), "kaiming"
            N(0, 2 / in), "evolved" (genes), a tensor, or a callable (shape, generator) -> tensor.
        population: P, dimensions of the population.
        dtype: The data type of the coefficients and the weights; None for torch's default.
        device: where they live; None for torch's default.

    Attributes:
        rules: the coefficients, see `RuleBank`.
        bias: (*P, out, 1), or None.
        fixed: (*P, out, in), or None.
        alpha: (*P, out, in), or None.
        initial: (*P, out, in) with init="evolved", or None.

    Raises:
        ValueError: an argument that is not as said here.
    """

    rules: Bank
    bias: nn.Parameter | None
    fixed: nn.Parameter | None
    alpha: nn.Parameter | None
    initial: nn.Parameter | None
    given: Tensor | None

    def __init__(
        self,
        n_in: int,
        n_out: int,
        *,
        rule: str | LearningRule | Callable[..., Tensor] = "abcd",
        sharing: str = "full",
        groups: Sequence[Hashable] | None = None,
        eta: float | str = ETA,
        normalize: str | Bound | None = None,
        terms: str = TERMS,
        exchange_bc: bool = False,
        average: int = 1,
        every: int = 1,
        decay: float = 0.0,
        clip: float | None = None,
        trace_decay: float = 0.0,
        activation: str | Activation = "tanh",
        output_activation: str | Activation | None = None,
        bias: bool = False,
        fixed: bool = False,
        init: Init = "zeros",
        population: Sequence[int] = (),
        dtype: torch.dtype | None = None,
        device: torch.device | str | None = None,
    ) -> None:
        super().__init__()
        self.n_in, self.n_out = check_sizes((n_in, n_out))
        self.sharing = sharing
        self.normalize: Any = normalize
        self.population = check_population(population)
        self.activation = activation if output_activation is None else output_activation
        self._activation = activation_named(self.activation)
        self.plasticity = Plasticity(
            average, every, decay, clip, trace_decay, bound_named(normalize)
        )
        made: dict[str, Any] = {"population": self.population, "dtype": dtype, "device": device}
        if sharing == "neuron":
            check_neuron_rule(rule, exchange_bc)
            ends: dict[str, Any] = {"terms": terms, "eta": eta}
            self.rules = NeuronBank(
                NeuronGenes(self.n_in, outgoing=True, incoming=False, **ends, **made),
                NeuronGenes(self.n_out, outgoing=False, incoming=True, **ends, **made),
                **ends,
            )
        else:
            self.rules = RuleBank(
                rule_grid(sharing, self.n_in, self.n_out, groups),
                rule=rule_named(rule),
                eta=eta,
                terms=terms,
                exchange_bc=exchange_bc,
                **made,
            )
        like = self.rules.like
        rows = (*self.population, self.n_out)

        def parameter(wanted: bool, columns: int) -> nn.Parameter | None:
            return nn.Parameter(like.new_empty((*rows, columns))) if wanted else None

        self.register_parameter("bias", parameter(bias, 1))
        self.register_parameter("fixed", parameter(fixed, self.n_in))
        self.register_parameter("alpha", parameter(fixed, self.n_in))
        self.init = init if isinstance(check_init(init), str) or callable(init) else "given"
        evolved = isinstance(init, str) and init == "evolved"
        self.register_parameter("initial", parameter(evolved, self.n_in))
        given = init.detach().to(like) if isinstance(init, Tensor) else None
        self.register_buffer("given", given)
        if given is not None:
            draw_weights(given, (*rows, self.n_in), None, dtype=like.dtype, device=like.device)
        redraw((p for p in self.parameters(recurse=False)), None)

    @classmethod
    def from_linear(cls, linear: nn.Linear, **options: Any) -> Self:
        """A trained layer made plastic: its weights are the initial plastic ones.

        Its bias becomes the bias, its activation is "identity", and its rules are zero, so that
        it does what `linear` does until its rules are set. It is a copy.

        >>> linear = torch.nn.Linear(4, 3)
        >>> x = torch.rand(4)
        >>> y, state = HebbianLinear.from_linear(linear)(x, plastic=False)
        >>> torch.allclose(y, linear(x))
        True

        Args:
            linear: the layer; with a population each individual gets its weights.
            options: The options of the new layer, such as `activation="tanh"`, `rule="oja"`,
                `normalize`.

        Raises:
            ValueError: an option that is not one of this class.
        """
        weight = linear.weight.detach()
        has_bias = linear.bias is not None
        made: dict[str, Any] = {"dtype": weight.dtype, "device": weight.device}
        made |= {"bias": has_bias, "init": weight, "activation": "identity"}
        layer = cls(
            linear.in_features,
            linear.out_features,
            **{**made, **options},
        )
        with torch.no_grad():
            for _, gene in layer.rules.named_genes():
                gene.zero_()
            if layer.bias is not None and has_bias:
                layer.bias.copy_(linear.bias.unsqueeze(-1))
            if layer.fixed is not None and layer.alpha is not None:
                layer.fixed.zero_()
                layer.alpha.fill_(1.0)
        return layer

    def dynamics(self) -> dict[str, Any]:
        """See `Described`."""
        return {
            "rule": self.rules.rule.name,
            "sharing": self.sharing,
            "columns": getattr(self.rules, "_columns", None),
            "eta": self.rules.eta,
            "terms": self.rules.terms,
            "exchange_bc": getattr(self.rules, "exchange_bc", False),
            "normalize": option(self.normalize),
            "activation": option(self.activation),
            **self.plasticity.options(),
        }

    def gene_parameters(self) -> list[tuple[int, str, nn.Parameter]]:
        """See `Evolvable`: the rules, then bias, fixed, alpha and initial weights, if any."""
        own = [(n, p) for n, p in self.named_parameters(recurse=False)]
        return [(0, name, parameter) for name, parameter in [*self.rules.named_genes(), *own]]

    def coefficients(self) -> Rule:
        """A, B, C, D, each broadcastable to (*P, out, in); zero for a term that does not exist.

        Raises:
            ValueError: the rule is another one; `named_coefficients()` has its coefficients.
        """
        if self.rules.rule != RULES["abcd"]:
            raise ValueError(
                f"coefficients: expected the rule 'abcd', got {self.rules.rule.name!r}; "
                f"use named_coefficients()"
            )
        return Rule(*self.rules.values())

    def named_coefficients(self) -> dict[str, Tensor]:
        """Name -> coefficient of the rule, each broadcastable to (*P, out, in)."""
        return dict(zip(self.rules.rule.coefficients, self.rules.values(), strict=True))

    def learning_rate(self) -> float | Tensor:
        """eta: the fixed number, or a tensor broadcastable to (*P, out, in)."""
        return self.rules.learning_rate()

    def initial_weights(
        self,
        init: Init | None = None,
        *,
        batch: Sequence[int] = (),
        generator: Generators = None,
    ) -> Tensor:
        """Initial weights, (*batch, *P, out, in); the arguments are those of `initial_state`."""
        like = self.rules.like
        shape = (*check_batch(batch), *self.population, self.n_out, self.n_in)
        chosen = check_init(self._own_init() if init is None else init)
        if isinstance(chosen, str) and chosen == "evolved":
            if self.initial is None:
                raise ValueError(
                    "init: expected a layer built with init='evolved', whose genes they are"
                )
            return self.initial.clone().expand(shape)
        return draw_weights(chosen, shape, generator, dtype=like.dtype, device=like.device)

    def _own_init(self) -> Init:
        return self.init if self.given is None else self.given

    def initial_state(
        self,
        init: Init | None = None,
        *,
        batch: Sequence[int] = (),
        generator: Generators = None,
    ) -> State:
        """The state in which an episode begins.

        Args:
            init: Initial plastic weights, as the argument `init` of the layer; None: the layer's
                own.
            batch: further dimensions, to the left of the population's.
            generator: where random numbers come from: one generator, torch's default one if
                None, or one generator per entry of the first of the dimensions (*batch, *P);
                each entry then gets what it would get alone.

        Raises:
            ValueError: unknown `init`, or a wrong number of generators.
        """
        weights = self.initial_weights(init, batch=batch, generator=generator)
        memory = self.plasticity.initial_memory(weights, self.rules.rule)
        return State((weights,), (memory,) if memory else ())

    def activate(self, x: Tensor, weights: Tensor) -> Tensor:
        """Activations of the post-synaptic neurons.

        Args:
            x: activations of the pre-synaptic neurons, (*batch, *P, in).
            weights: the plastic weights, (*batch, *P, out, in).

        Returns:
            f(W x + b), (*batch, *P, out).

        Raises:
            ValueError: shapes or dtypes that do not fit.
        """
        dtype = self.rules.like.dtype
        if weights.dtype != dtype:
            raise ValueError(
                f"state: expected weights of {dtype}, as the rules are, got {weights.dtype}; "
                f"convert with state.to(dtype={dtype})"
            )
        x = fitting_input(x, weights, self.n_in, self.n_out, self.population)
        return self._activation(weighted_sum(x, self.effective(weights), self.bias))

    def effective(self, weights: Tensor) -> Tensor:
        """The weights that act, fixed + alpha * plastic ones, (*batch, *P, out, in)."""
        if self.fixed is None or self.alpha is None:
            return weights
        return self.fixed + self.alpha * weights

    def forward(
        self,
        x: Tensor,
        state: State | None = None,
        plastic: bool | Tensor = True,
        *,
        modulation: Tensor | None = None,
    ) -> tuple[Tensor, State]:
        """One step: the output under the present weights, then their update.

        Args:
            x: (*batch, *P, in), in the layer's dtype or a lower precision.
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
        check_state(state, 1)
        (weights,) = state.weights
        memory = memory_of(state, 0)
        y = self.activate(x, weights)
        if plastic is False and not memory:
            return y, state
        if plastic is True and not memory and modulation is None:
            return y, State((self.update(weights, x, y),))
        weights, memory = self._learn(weights, memory, x, y, plastic, modulation)
        return y, State((weights,), (memory,) if memory else ())

    def update(self, weights: Tensor, pre: Tensor, post: Tensor) -> Tensor:
        """The weights after one plastic step of a layer that remembers nothing.

        Args:
            weights: (*batch, *P, out, in).
            pre: (*batch, *P, in).
            post: (*batch, *P, out).
        """
        return self._learn(weights, {}, pre, post, True, None)[0]

    def _learn(
        self,
        weights: Tensor,
        memory: Memory,
        x: Tensor,
        y: Tensor,
        plastic: bool | Tensor,
        modulation: Tensor | None,
    ) -> tuple[Tensor, Memory]:
        """The weights and the memory after one step, see `Plasticity.step`."""
        return self.plasticity.step(
            self.rules.rule,
            self.named_coefficients(),
            self.learning_rate(),
            weights,
            memory,
            x.to(weights.dtype).unsqueeze(-2),
            y.to(weights.dtype).unsqueeze(-1),
            plastic,
            modulation,
        )

    def extra_repr(self) -> str:
        """What `print(layer)` shows."""
        shown = {"sharing": self.sharing, "eta": self.rules.eta, "normalize": self.normalize}
        shown |= {"terms": self.rules.terms, "population": self.population}
        text = ", ".join(f"{name}={value!r}" for name, value in shown.items())
        return f"{self.n_in}, {self.n_out}, {text}"
