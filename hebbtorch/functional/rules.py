"""Learning rules as pure functions on plain tensors, and the registry of their names.

| name           | change of a weight, times eta                              | source |
|----------------|------------------------------------------------------------|--------|
| "abcd"         | A x y + B x + C y + D                                      | paper, Eq. (3) |
| "hebb"         | c x y                                                      | Hebb 1949; paper, Eq. (2) |
| "oja"          | c (x y - y^2 w)                                            | Oja, J. Math. Biology 15 (1982) |
| "bcm"          | c x y (y - theta), theta += (y^2 - theta) / tau            | Bienenstock, Cooper, Munro, J. Neuroscience 2 (1982) |
| "differential" | c (x_t - x_{t-1}) (y_t - y_{t-1}); nothing in a life's first step | Kosko, AIP Conf. Proc. 151 (1986) |

x is the activation before the synapse, y the one after it, w its weight. A rule of one's own is
a function of w, x, y and its coefficients:

>>> def decaying(w, x, y, c=1.0, d=0.1):
...     return c * x * y - d * w
>>> net = hebbtorch.HebbianMLP([3, 4, 2], rule=decaying)
>>> [block.name for block in net.gene_blocks]
['c', 'd', 'c', 'd']
"""  # noqa: E501

from __future__ import annotations

import inspect
import keyword
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import torch
from torch import Tensor

PLACES = ("pre", "post", "synapse", "individual")
_RESERVED = ("eta", "eta_gene", "rule", "terms", "exchange_bc")


class Rule(NamedTuple):
    """The four coefficients of the ABCD rule, each broadcastable to (*P, out, in), no unit.

    Attributes:
        A: weighs the product of pre- and post-synaptic activation.
        B: weighs the pre-synaptic activation.
        C: weighs the post-synaptic activation.
        D: The constant drift.
    """

    A: Tensor
    B: Tensor
    C: Tensor
    D: Tensor


def _is_free(name: str) -> bool:
    """Whether a coefficient may be called so: it becomes an attribute of a module."""
    is_name = name.isidentifier() and not keyword.iskeyword(name)
    return is_name and name not in _RESERVED and not hasattr(torch.nn.Module, name)


@dataclass(frozen=True)
class LearningRule:
    """How a synapse changes: a function, its coefficients and what it remembers.

    Attributes:
        name: what it is called.
        change: (w, x, y, *coefficients) -> change of the weights before it is multiplied by the
            learning rate; w is (*batch, *P, out, in), x (*batch, *P, 1, in), y (*batch, *P, out,
            1), each coefficient broadcastable to w. A rule with memory takes it by name and
            returns (change, new memory), a dict.
        coefficients: name -> value in a new layer, None for a draw from U(-1, 1). They are genes
            and parameters.
        memory: name -> place of what it remembers from step to step, zero at first: "pre" (as
            x), "post" (as y), "synapse" (as w) or "individual", (*batch, *P, 1, 1).
        source: where it was published.
    """

    name: str
    change: Callable[..., Any]
    coefficients: Mapping[str, float | None]
    memory: Mapping[str, str] = field(default_factory=dict)
    source: str = ""

    def __post_init__(self) -> None:
        bad = [c for c in self.coefficients if not _is_free(c)]
        if bad or not self.coefficients:
            raise ValueError(
                f"rule: expected coefficients named by identifiers other than {_RESERVED}, "
                f"got {list(self.coefficients)}"
            )
        if not set(self.memory.values()) <= set(PLACES):
            raise ValueError(
                f"rule: expected memory in places of {PLACES}, got {dict(self.memory)}"
            )


def abcd_change(
    weights: Tensor, x: Tensor, y: Tensor, a: Tensor, b: Tensor, c: Tensor, d: Tensor
) -> Tensor:
    """A x y + B x + C y + D, factored as y (A x + C) + (B x + D): fewer passes (Eq. 3)."""
    slope = torch.addcmul(c, a, x)
    offset = torch.addcmul(d, b, x)
    return torch.addcmul(offset, slope, y)


def abcd_update(
    weights: Tensor, rule: Rule, eta: float | Tensor, pre: Tensor, post: Tensor
) -> Tensor:
    """One plastic step: w + eta (A x y + B x + C y + D), x pre-, y post-synaptic.

    A pure function: differentiable in every argument, usable under `torch.func`, and it never
    writes into what it was given. Every operation is elementwise, so an individual's result
    does not depend, in any bit, on the others in the batch.

    Args:
        weights: (*P, out, in).
        rule: coefficients, each broadcastable to (*P, out, in).
        eta: learning rate, a number or a tensor broadcastable to (*P, out, in).
        pre: activations of the pre-synaptic neurons, (*P, in).
        post: activations of the post-synaptic neurons, (*P, out).

    Returns:
        The new weights, (*P, out, in).
    """
    change = abcd_change(weights, pre.unsqueeze(-2), post.unsqueeze(-1), *rule)
    return weights + eta * change  # Eq. (1)


def hebb_change(weights: Tensor, x: Tensor, y: Tensor, c: Tensor) -> Tensor:
    """c x y: what fires together wires together (Eq. 2)."""
    return c * x * y


def oja_change(weights: Tensor, x: Tensor, y: Tensor, c: Tensor) -> Tensor:
    """c (x y - y^2 w): a linear neuron's weights become the first principal component, |w| = 1."""
    return c * (x * y - y * y * weights)


def differential_change(
    weights: Tensor,
    x: Tensor,
    y: Tensor,
    c: Tensor,
    *,
    last_x: Tensor,
    last_y: Tensor,
    begun: Tensor,
) -> tuple[Tensor, dict[str, Tensor]]:
    """c (x_t - x_{t-1}) (y_t - y_{t-1}), with nothing in the first step of a life."""
    change = c * (x - last_x) * (y - last_y) * begun
    return change, {"last_x": x, "last_y": y, "begun": torch.ones_like(begun)}


def bcm_change(
    weights: Tensor, x: Tensor, y: Tensor, c: Tensor, *, theta: Tensor, tau: float
) -> tuple[Tensor, dict[str, Tensor]]:
    """c x y (y - theta); then theta += (y^2 - theta) / tau."""
    return c * x * y * (y - theta), {"theta": theta + (y * y - theta) / tau}


def bcm(tau: float = 10.0) -> LearningRule:
    """The BCM rule: c x y (y - theta), with a threshold that follows y^2.

    Of a single pattern shown to a linear neuron, y = theta = 1 is the fixed point. The threshold
    must be faster than the weights: with |x|^2 eta c tau well below 1 it is stable.

    Args:
        tau: time constant of theta [steps], at least 1.

    Raises:
        ValueError: tau below 1.
    """
    if not tau >= 1:
        raise ValueError(f"tau: expected a number of steps of at least 1, got {tau!r}")
    source = "Bienenstock, Cooper, Munro, J. Neuroscience 2 (1982)"
    name = "bcm" if tau == 10.0 else f"bcm(tau={tau:g})"
    change = partial(bcm_change, tau=tau)
    return LearningRule(name, change, {"c": 1.0}, {"theta": "post"}, source)


RULES: dict[str, LearningRule] = {
    rule.name: rule
    for rule in (
        LearningRule("abcd", abcd_change, dict.fromkeys("ABCD"), source="paper, Eq. (3)"),
        LearningRule("hebb", hebb_change, {"c": 1.0}, source="Hebb 1949; paper, Eq. (2)"),
        LearningRule("oja", oja_change, {"c": 1.0}, source="Oja, J. Math. Biology 15 (1982)"),
        bcm(),
        LearningRule(
            "differential",
            differential_change,
            {"c": 1.0},
            {"last_x": "pre", "last_y": "post", "begun": "individual"},
            source="Kosko, AIP Conference Proceedings 151 (1986)",
        ),
    )
}


def rule_named(rule: str | LearningRule | Callable[..., Tensor]) -> LearningRule:
    """The rule of that name, the rule itself, or a function made a rule.

    Args:
        rule: a name in `RULES`; a `LearningRule`; or a function (w, x, y, *coefficients) ->
            change, whose further parameters are the coefficients, with their defaults as values
            in a new layer (without default: drawn from U(-1, 1)).

    Raises:
        ValueError: an unknown name, or a function without coefficients.
    """
    if isinstance(rule, LearningRule):
        return rule
    if not callable(rule):
        if rule not in RULES:
            raise ValueError(
                f"rule: expected one of {tuple(RULES)}, a LearningRule or a function of "
                f"(w, x, y, *coefficients), got {rule!r}"
            )
        return RULES[rule]
    declared = list(inspect.signature(rule).parameters.values())[3:]
    empty = inspect.Parameter.empty
    values = {p.name: None if p.default is empty else float(p.default) for p in declared}
    return LearningRule(getattr(rule, "__name__", type(rule).__name__), rule, values)
