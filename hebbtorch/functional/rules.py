"""The Hebbian ABCD rule as a pure function on plain tensors (paper, Eq. 3)."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor


class Rule(NamedTuple):
    """The four coefficients of the ABCD rule, each broadcastable to (*P, out, in), no unit.

    Attributes:
        A: weighs the product of pre- and post-synaptic activation.
        B: weighs the pre-synaptic activation.
        C: weighs the post-synaptic activation.
        D: constant drift.
    """

    A: Tensor
    B: Tensor
    C: Tensor
    D: Tensor


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
    x = pre.unsqueeze(-2)
    y = post.unsqueeze(-1)
    # Eq. (3), factored as y (A x + C) + (B x + D): fewer passes over the synapses.
    slope = torch.addcmul(rule.C, rule.A, x)
    offset = torch.addcmul(rule.D, rule.B, x)
    return weights + eta * torch.addcmul(offset, slope, y)  # Eq. (1)
