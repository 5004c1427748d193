"""The rules of a layer as parameters of a module."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from numbers import Real

import torch
from torch import Tensor, nn

from hebbtorch.functional.rules import RULES, LearningRule
from hebbtorch.sampling import Generators, redraw
from hebbtorch.sharing import RuleGrid

ETA = 0.01  # the paper's learning rate (Sec. III-B), and what an eta gene of 0 stands for
TERMS = "ABCD"


def check_eta(eta: object) -> float | str:
    """The learning rate, as a number of Python's or as "evolved".

    Raises:
        ValueError: neither "evolved" nor a finite number.
    """
    if isinstance(eta, str) and eta == "evolved":
        return eta
    if not isinstance(eta, Real) or isinstance(eta, bool) or not math.isfinite(eta):
        raise ValueError(f"eta: expected a finite number or 'evolved', got {eta!r}")
    return eta if isinstance(eta, int | float) else float(eta)


def check_terms(terms: str) -> str:
    """The terms of an ABCD rule, as they came.

    Raises:
        ValueError: not one or several of the letters ABCD, in this order.
    """
    if not isinstance(terms, str) or not terms or terms != "".join(t for t in TERMS if t in terms):
        raise ValueError(
            f"terms: expected one or several of the letters ABCD, in this order and each once, "
            f"such as 'BCD' without A, got {terms!r}"
        )
    return terms


def rate_of(gene: Tensor) -> Tensor:
    """The learning rate 0.01 * 10**gene: 0 is the paper's, one unit a factor of ten."""
    # exp, not pow: torch's pow rounds the end of an array unlike its beginning.
    return ETA * torch.exp(math.log(10.0) * gene)


class Bank(nn.Module, ABC):
    """What a layer asks of its rules, however they are stored.

    Attributes:
        rule: the learning rule that the coefficients belong to.
        terms: names of the coefficients that exist; the others are zero.
        eta: the fixed learning rate, or "evolved".
    """

    rule: LearningRule
    terms: str
    eta: float | str

    @abstractmethod
    def named_genes(self) -> list[tuple[str, nn.Parameter]]:
        """(name, parameter) in the order of the genes."""

    @abstractmethod
    def values(self) -> list[Tensor]:
        """The coefficients in the order of the rule's, each broadcastable to (*P, out, in)."""

    @abstractmethod
    def learning_rate(self) -> float | Tensor:
        """eta: the fixed number, or a tensor broadcastable to (*P, out, in)."""

    @property
    @abstractmethod
    def like(self) -> Tensor:
        """A parameter, for its dtype and device."""


def _restore_constants(bank: RuleBank, _: object = None) -> None:
    """Make the buffers that no state_dict holds, where the parameters are (after `to_empty`)."""
    for name in bank.rule.coefficients:
        if name not in bank.names:
            setattr(bank, name, bank.like.new_zeros(1, 1))
    if bank._columns is not None:
        bank.column_of_input = torch.tensor(bank._columns, device=bank.like.device)


class RuleBank(Bank):
    """The rules of a layer, stored once each; layers that share their rules share the bank.

    Each coefficient of the rule is a parameter of its name, (*P, rows, columns), no unit: A, B, C
    and D of the ABCD rule; a constant zero of shape (1, 1) for a term that does not exist.

    Args:
        grid: the distinct rules of the layer.
        rule: what the coefficients belong to.
        eta: learning rate, or "evolved".
        terms: Which coefficients of the ABCD rule exist.
        exchange_bc: whether B weighs the post- and C the pre-synaptic activation, as in the
            paper's own code.
        population: P, dimensions of the population.
        dtype: The data type of the coefficients.
        device: where they live.

    Attributes:
        names: The names of the coefficients that exist.
        eta_gene: The genes of the learning rate with eta="evolved", one per rule, (*P, rows,
            columns); the learning rate is 0.01 * 10**gene: it is always positive (a negative one
            would only turn the signs of the coefficients).
    """

    eta_gene: nn.Parameter | None

    def __init__(
        self,
        grid: RuleGrid,
        *,
        rule: LearningRule = RULES["abcd"],
        eta: float | str = ETA,
        terms: str = TERMS,
        exchange_bc: bool = False,
        population: tuple[int, ...] = (),
        dtype: torch.dtype | None = None,
        device: torch.device | str | None = None,
    ) -> None:
        super().__init__()
        self.eta = check_eta(eta)
        self.rule = rule
        self.terms = check_terms(terms)
        is_abcd = rule == RULES["abcd"]
        if not is_abcd and (terms != TERMS or exchange_bc):
            raise ValueError(
                f"terms, exchange_bc: expected neither with rule {rule.name!r}, they are of 'abcd'"
            )
        self.exchange_bc = exchange_bc
        self.names = [name for name in rule.coefficients if not is_abcd or name in terms]

        def coefficient() -> nn.Parameter:
            shape = (*population, grid.rows, grid.columns)
            return nn.Parameter(torch.empty(shape, dtype=dtype, device=device))

        for name in rule.coefficients:
            if name in self.names:
                self.register_parameter(name, coefficient())
            else:
                self.register_buffer(name, torch.empty(0), persistent=False)
        self.register_parameter("eta_gene", coefficient() if eta == "evolved" else None)
        self._columns = grid.column_of_input
        self.column_of_input: Tensor | None
        self.register_buffer("column_of_input", None, persistent=False)
        self.register_load_state_dict_post_hook(_restore_constants)
        self.reset_parameters()

    @property
    def like(self) -> Tensor:
        """See `Bank`."""
        tensor: Tensor = getattr(self, self.names[0])
        return tensor

    def reset_parameters(self, generator: Generators = None) -> None:
        """Set every gene to its value in a new layer.

        For the coefficients of "abcd" and the genes of eta it is a draw from U(-1, 1), as in
        Algorithm 1's first population, for those of the classical rules 1.
        """
        values = self.rule.coefficients
        drawn = (p for n, p in self.named_parameters() if values.get(n) is None)
        redraw(drawn, generator)
        for name in self.names:
            value = values[name]
            if value is not None:
                nn.init.constant_(self.get_parameter(name), value)
        _restore_constants(self)

    def named_genes(self) -> list[tuple[str, nn.Parameter]]:
        """(name, parameter) in the order of the genes: the terms and, if evolved, eta."""
        if not all(name in self._parameters for name in self.names):
            expected = self.terms if self.rule == RULES["abcd"] else self.names
            raise ValueError(
                f"genes: expected the terms {expected} to be plain parameters, got "
                f"{sorted(self._parameters)}; remove the parametrization or pruning first"
            )
        named = [(name, self.get_parameter(name)) for name in self.names]
        return named if self.eta_gene is None else [*named, ("eta", self.eta_gene)]

    def values(self) -> list[Tensor]:
        """See `Bank`; zero for a term that does not exist."""
        values: list[Tensor] = [getattr(self, name) for name in self.rule.coefficients]
        for index, name in enumerate(self.rule.coefficients):
            if name in self.names:
                values[index] = self._per_input(values[index])
        if self.exchange_bc:
            values[1], values[2] = values[2], values[1]
        return values

    def learning_rate(self) -> float | Tensor:
        """See `Bank`."""
        if self.eta_gene is None:
            return float(self.eta)
        return rate_of(self._per_input(self.eta_gene))

    def _per_input(self, parameter: Tensor) -> Tensor:
        column = self.column_of_input
        return parameter if column is None else parameter.index_select(-1, column)
