"""What the weights and the neurons of a plastic layer are like, in numbers; see `Monitor`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import torch
from torch import Tensor

if TYPE_CHECKING:
    from hebbtorch.linear import HebbianLinear

SATURATED = 0.9  # a neuron beyond this is called saturated


def mean_abs(weights: Tensor) -> Tensor:
    """Mean magnitude of the weights (*lead, out, in) of each individual, (*lead,)."""
    return weights.abs().mean((-2, -1))


def weight_measures(weights: Tensor) -> dict[str, Tensor]:
    """How large the weights of each individual are.

    >>> measures = weight_measures(torch.tensor([[1.0, -3.0]]))
    >>> {name: value.item() for name, value in measures.items()}
    {'weight_mean_abs': 2.0, 'weight_max_abs': 3.0}

    Args:
        weights: (*lead, out, in).

    Returns:
        weight_mean_abs and weight_max_abs, (*lead,) each.
    """
    sizes = weights.abs()
    return {"weight_mean_abs": sizes.mean((-2, -1)), "weight_max_abs": sizes.amax((-2, -1))}


def step_measures(y: Tensor, old: Tensor, new: Tensor, start: Tensor) -> dict[str, Tensor]:
    """What one step did to the weights of each individual, and how its neurons are.

    Args:
        y: activations of the post-synaptic neurons, (*lead, out).
        old: weights before the step, (*lead, out, in).
        new: weights after it.
        start: weights when the episode began.

    Returns:
        `weight_measures`, update_mean_abs, drift_from_birth, sign_changes and saturated, as
        `Monitor` explains them, (*lead,) each.
    """
    return {
        **weight_measures(new),
        "update_mean_abs": mean_abs(new - old),
        "drift_from_birth": mean_abs(new - start),
        "sign_changes": (new * old).lt_(0).mean((-2, -1)),
        "saturated": y.abs().gt_(SATURATED).mean(-1),
    }


def term_sizes(layer: HebbianLinear, xy: Tensor, x: Tensor, y: Tensor, steps: int = 1) -> Tensor:
    """Sizes of the terms of the ABCD rule, |eta A x y| and so on, summed over the synapses.

    Args:
        layer: whose rules they are.
        xy: |x| |y| of each synapse, summed over the steps, (*lead, out, in).
        x: |x| likewise, (*lead, 1, in).
        y: |y| likewise, (*lead, out, 1).
        steps: how many steps were summed.

    Returns:
        Of A, B, C and D, (*lead, 4).
    """
    eta = layer.learning_rate()
    a, b, c, d = layer.coefficients()
    factors = ((a, xy), (b, x), (c, y), (d, steps))
    # In place, since fresh memory is dearer here than the arithmetic.
    terms = ((eta * each.expand(xy.shape)).abs_().mul_(factor) for each, factor in factors)
    return torch.stack([term.sum((-2, -1), dtype=xy.dtype) for term in terms], -1)


def term_shares(layer: HebbianLinear, x: Tensor, y: Tensor) -> dict[str, Tensor]:
    """Share of each term of the ABCD rule in the size of one change.

    Args:
        layer: whose rules they are.
        x: activations of the pre-synaptic neurons, (*lead, in).
        y: Activations of the post-synaptic neurons, (*lead, out).

    Returns:
        share_A, share_B, share_C and share_D, (*lead,) each; NaN where nothing changes.
    """
    pre, post = x.abs().unsqueeze(-2), y.abs().unsqueeze(-1)
    sizes = term_sizes(layer, pre * post, pre, post)
    shares = (sizes / sizes.sum(-1, keepdim=True)).unbind(-1)
    return {f"share_{term}": share for term, share in zip("ABCD", shares, strict=True)}
