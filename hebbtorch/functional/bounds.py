"""Bounds on the plastic weights, applied after each update (paper, Sec. IV-C)."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor

Bound = Callable[[Tensor], Tensor]


def l2_normalize(weights: Tensor) -> Tensor:
    """Divide each neuron's incoming weights by their Euclidean norm.

    A row of zeros (or one whose squares underflow to zero) stays as it is, with finite gradients.

    >>> l2_normalize(torch.tensor([[3.0, 4.0], [0.0, 0.0]])).tolist()
    [[0.6000000238418579, 0.800000011920929], [0.0, 0.0]]

    Args:
        weights: (*P, out, in).

    Returns:
        New weights, (*P, out, in), each row of norm 1 or 0.
    """
    wide = weights.float() if weights.dtype in (torch.float16, torch.bfloat16) else weights
    squares = (wide * wide).contiguous().sum(-1, keepdim=True)
    # The inner `where` keeps sqrt away from 0, where its gradient is infinite.
    return (wide / torch.where(squares > 0, squares, 1.0).sqrt()).to(weights.dtype)


def minmax_rescale(weights: Tensor) -> Tensor:
    """Map each neuron's incoming weights onto [-1, 1], from the least to the greatest of them.

    This is what the paper's own code does where its text says `l2_normalize`. A row of equal
    weights stays as it is.

    >>> minmax_rescale(torch.tensor([[3.0, 4.0, 5.0], [7.0, 7.0, 7.0]])).tolist()
    [[-1.0, 0.0, 1.0], [7.0, 7.0, 7.0]]

    Args:
        weights: (*P, out, in).

    Returns:
        New weights, (*P, out, in), each row from -1 to 1.
    """
    low, high = weights.amin(-1, keepdim=True), weights.amax(-1, keepdim=True)
    span = high - low
    spread = (weights - low) / torch.where(span > 0, span, 1.0) * 2.0 - 1.0
    return torch.where(span > 0, spread, weights)


def max_normalize(weights: Tensor) -> Tensor:
    """Divide a layer's weights by the greatest of their magnitudes.

    A layer of zeros stays as it is. Source: Dittrich et al., arXiv 2603.22512 (2026).

    >>> max_normalize(torch.tensor([[1.0, -4.0], [0.0, 2.0]])).tolist()
    [[0.25, -1.0], [0.0, 0.5]]

    Args:
        weights: (*P, out, in).

    Returns:
        New weights, (*P, out, in), of magnitudes up to 1.
    """
    greatest = weights.abs().amax((-2, -1), keepdim=True)
    return weights / torch.where(greatest > 0, greatest, 1.0)


BOUNDS: dict[str | None, Bound | None] = {
    None: None,
    "l2": l2_normalize,
    "minmax": minmax_rescale,
    "max": max_normalize,
}


def bound_named(normalize: str | Bound | None) -> Bound | None:
    """The bound called `normalize`, a bound of one's own, or None for unbounded weights.

    Raises:
        ValueError: the name is unknown.
    """
    if callable(normalize):
        return normalize
    if normalize not in BOUNDS:
        raise ValueError(
            f"normalize: expected None, 'l2', 'minmax', 'max' or a function of the weights, "
            f"got {normalize!r}"
        )
    return BOUNDS[normalize]
