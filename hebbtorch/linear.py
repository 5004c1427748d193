"""One layer of plastic synapses."""

from __future__ import annotations

from collections.abc import Hashable, Sequence

import torch
from torch import Tensor, nn

from hebbtorch.functional.activation import fitting_input, weighted_sum
from hebbtorch.functional.bounds import bound_named
from hebbtorch.functional.rules import Rule, abcd_update
from hebbtorch.genome import Evolvable, check_batch, check_population, check_sizes
from hebbtorch.rule_bank import ETA, TERMS, RuleBank
from hebbtorch.sampling import Generators, check_init, draw_uniform
from hebbtorch.sharing import rule_grid
from hebbtorch.state import State, check_state


class HebbianLinear(Evolvable):
    """Plastic synapses from `n_in` to `n_out` neurons with tanh activation and no bias.

    The weights are state, not parameters: see `initial_state` and `forward`. Any dimensions to
    the left of the population's are batch: several lives under the same rules.

    Args:
        n_in: number of pre-synaptic neurons.
        n_out: number of post-synaptic neurons.
        sharing: which synapses share a rule, see `hebbtorch.sharing`.
        groups: with sharing="grouped", one label per input.
        eta: learning rate; or "evolved", one gene per rule, eta = 0.01 * 10**gene.
        normalize: None; "l2": incoming weights are divided by their norm after each update; or
            "minmax": they are mapped onto [-1, 1].
        terms: which terms of the rule exist, such as "BCD" without A; the others have no genes
            and are zero.
        exchange_bc: True lets B weigh the post- and C the pre-synaptic activation, as the paper's
            own code does; Eq. (3) has them the other way round.
        population: P, dimensions of the population.
        dtype: of the coefficients and the weights; None for torch's default.
        device: where they live; None for torch's default.

    Raises:
        ValueError: an argument that is not as said here.
    """

    def __init__(
        self,
        n_in: int,
        n_out: int,
        *,
        sharing: str = "full",
        groups: Sequence[Hashable] | None = None,
        eta: float | str = ETA,
        normalize: str | None = None,
        terms: str = TERMS,
        exchange_bc: bool = False,
        population: Sequence[int] = (),
        dtype: torch.dtype | None = None,
        device: torch.device | str | None = None,
    ) -> None:
        super().__init__()
        self.n_in, self.n_out = check_sizes((n_in, n_out))
        self.sharing = sharing
        self.normalize = normalize
        self.population = check_population(population)
        self._bound = bound_named(normalize)
        grid = rule_grid(sharing, self.n_in, self.n_out, groups)
        self.rules = RuleBank(
            grid,
            eta=eta,
            terms=terms,
            exchange_bc=exchange_bc,
            population=self.population,
            dtype=dtype,
            device=device,
        )

    def gene_parameters(self) -> list[tuple[int, str, nn.Parameter]]:
        """See `Evolvable`."""
        return [(0, name, parameter) for name, parameter in self.rules.named_genes()]

    def coefficients(self) -> Rule:
        """A, B, C, D, each broadcastable to (*P, out, in); zero for a term that does not exist."""
        return self.rules.coefficients()

    def learning_rate(self) -> float | Tensor:
        """eta: the fixed number, or a tensor broadcastable to (*P, out, in)."""
        return self.rules.learning_rate()

    def initial_weights(
        self, init: str = "zeros", *, batch: Sequence[int] = (), generator: Generators = None
    ) -> Tensor:
        """Weights at birth, (*batch, *P, out, in); the arguments are those of `initial_state`."""
        check_init(init)
        shape = (*check_batch(batch), *self.population, self.n_out, self.n_in)
        like = self.rules.A
        if init == "zeros":
            return torch.zeros(shape, dtype=like.dtype, device=like.device)
        return draw_uniform(shape, generator, dtype=like.dtype, device=like.device)

    def initial_state(
        self, init: str = "zeros", *, batch: Sequence[int] = (), generator: Generators = None
    ) -> State:
        """The state at birth.

        Args:
            init: "zeros" (the paper's) or "uniform", U(-1, 1).
            batch: further dimensions, to the left of the population's.
            generator: for "uniform", where the numbers come from: one generator, torch's default
                one if None, or one generator per entry of the first of the dimensions
                (*batch, *P); each entry then gets what it would get alone.

        Raises:
            ValueError: unknown `init`, or a wrong number of generators.
        """
        return State((self.initial_weights(init, batch=batch, generator=generator),))

    def activate(self, x: Tensor, weights: Tensor) -> Tensor:
        """Activations of the post-synaptic neurons.

        Args:
            x: activations of the pre-synaptic neurons, (*batch, *P, in).
            weights: (*batch, *P, out, in).

        Returns:
            tanh(W x), (*batch, *P, out).

        Raises:
            ValueError: shapes or dtypes that do not fit.
        """
        dtype = self.rules.A.dtype
        if weights.dtype != dtype:
            raise ValueError(
                f"state: expected weights of {dtype}, as the rules are, got {weights.dtype}; "
                f"convert with state.to(dtype={dtype})"
            )
        x = fitting_input(x, weights, self.n_in, self.n_out, self.population)
        return torch.tanh(weighted_sum(x, weights))

    def update(self, weights: Tensor, pre: Tensor, post: Tensor) -> Tensor:
        """The weights after one plastic step: Eq. (3), then the bound, if any.

        Args:
            weights: (*batch, *P, out, in).
            pre: (*batch, *P, in).
            post: (*batch, *P, out).
        """
        updated = abcd_update(weights, self.coefficients(), self.learning_rate(), pre, post)
        return updated if self._bound is None else self._bound(updated)

    def forward(self, x: Tensor, state: State, plastic: bool = True) -> tuple[Tensor, State]:
        """One step: the output under the present weights, then their update.

        Args:
            x: (*batch, *P, in).
            state: the present weights; left untouched.
            plastic: False leaves the weights as they are.

        Returns:
            y (*batch, *P, out) and the state of the next step.

        Raises:
            ValueError: shapes or dtypes that do not fit.
        """
        check_state(state, 1)
        (weights,) = state.weights
        y = self.activate(x, weights)
        return y, State((self.update(weights, x, y),)) if plastic else state

    def extra_repr(self) -> str:
        """What `print(layer)` shows."""
        return (
            f"{self.n_in}, {self.n_out}, sharing={self.sharing!r}, eta={self.rules.eta!r}, "
            f"normalize={self.normalize!r}, terms={self.rules.terms!r}, "
            f"population={self.population}"
        )
