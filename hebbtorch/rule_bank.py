"""The rules of a layer as parameters of a module."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from hebbtorch.functional.rules import Rule
from hebbtorch.sampling import Generators, redraw
from hebbtorch.sharing import RuleGrid

ETA = 0.01  # the paper's learning rate (Sec. III-B), and what an eta gene of 0 stands for
TERMS = "ABCD"


def check_terms(terms: str) -> str:
    """The terms of a rule, as they came.

    Raises:
        ValueError: not one or several of the letters ABCD, in this order.
    """
    if not isinstance(terms, str) or not terms or terms != "".join(t for t in TERMS if t in terms):
        raise ValueError(
            f"terms: expected one or several of the letters ABCD, in this order and each once, "
            f"such as 'BCD' without A, got {terms!r}"
        )
    return terms


def _restore_constants(bank: RuleBank, _: object = None) -> None:
    """Make the buffers that no state_dict holds, where the parameters are (after `to_empty`)."""
    like = bank.get_parameter(bank.terms[0])
    for term in TERMS:
        if term not in bank.terms:
            setattr(bank, term, like.new_zeros(1, 1))
    if bank._columns is not None:
        bank.column_of_input = torch.tensor(bank._columns, device=like.device)


class RuleBank(nn.Module):
    """The rules of a layer, stored once each; layers that share their rules share the bank.

    Attributes:
        terms: which of A, B, C, D exist, such as "ABCD" or, without A, "BCD".
        exchange_bc: whether B weighs the post- and C the pre-synaptic activation, as in the
            paper's own code.
        A, B, C, D: coefficients, (*P, rows, columns), no unit; parameters, or a constant zero of
            shape (1, 1) for a term that does not exist.
        eta_gene: with eta="evolved", one per rule, (*P, rows, columns); the learning rate is
            0.01 * 10**gene: 0 is the paper's 0.01, one unit a factor of ten, and it is always
            positive (a negative one would only turn the signs of A, B, C and D).
    """

    def __init__(
        self,
        grid: RuleGrid,
        *,
        eta: float | str = ETA,
        terms: str = TERMS,
        exchange_bc: bool = False,
        population: tuple[int, ...] = (),
        dtype: torch.dtype | None = None,
        device: torch.device | str | None = None,
    ) -> None:
        super().__init__()
        if eta != "evolved" and not (isinstance(eta, int | float) and math.isfinite(eta)):
            raise ValueError(f"eta: expected a finite number or 'evolved', got {eta!r}")
        self.eta = eta
        self.terms = check_terms(terms)
        self.exchange_bc = exchange_bc

        def coefficient() -> nn.Parameter:
            shape = (*population, grid.rows, grid.columns)
            return nn.Parameter(torch.empty(shape, dtype=dtype, device=device))

        self.A: Tensor
        self.B: Tensor
        self.C: Tensor
        self.D: Tensor
        for term in TERMS:
            if term in terms:
                self.register_parameter(term, coefficient())
            else:
                self.register_buffer(term, None, persistent=False)
        self.eta_gene = coefficient() if eta == "evolved" else None
        self.column_of_input: Tensor | None
        self._columns = grid.column_of_input
        self.register_buffer("column_of_input", None, persistent=False)
        self.register_load_state_dict_post_hook(_restore_constants)
        self.reset_parameters()

    def reset_parameters(self, generator: Generators = None) -> None:
        """Draw every gene from U(-1, 1), as Algorithm 1 does for its first population."""
        redraw(self.parameters(), generator)
        _restore_constants(self)

    def named_genes(self) -> list[tuple[str, nn.Parameter]]:
        """(name, parameter) in the order of the genes: the terms and, if evolved, eta."""
        if not all(term in self._parameters for term in self.terms):
            raise ValueError(
                f"genes: expected the terms {self.terms} to be plain parameters, got "
                f"{sorted(self._parameters)}; remove the parametrization or pruning first"
            )
        named = [(term, self.get_parameter(term)) for term in self.terms]
        return named if self.eta_gene is None else [*named, ("eta", self.eta_gene)]

    def coefficients(self) -> Rule:
        """A, B, C, D, each broadcastable to (*P, out, in); zero for a term that does not exist."""
        a, b, c, d = (
            self._per_input(coefficient) if term in self.terms else coefficient
            for term, coefficient in zip(TERMS, (self.A, self.B, self.C, self.D), strict=True)
        )
        return Rule(a, c, b, d) if self.exchange_bc else Rule(a, b, c, d)

    def learning_rate(self) -> float | Tensor:
        """eta: the fixed number, or a tensor broadcastable to (*P, out, in)."""
        if self.eta_gene is None:
            return float(self.eta)
        gene = self._per_input(self.eta_gene)
        # exp, not pow: torch's pow rounds the end of an array unlike its beginning.
        return ETA * torch.exp(math.log(10.0) * gene)

    def _per_input(self, parameter: Tensor) -> Tensor:
        column = self.column_of_input
        return parameter if column is None else parameter.index_select(-1, column)
