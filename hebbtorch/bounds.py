"""Bounds on the plastic weights, applied after each update (paper, Sec. IV-C)."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor


def l2_normalize(weights: Tensor) -> Tensor:
    """Divide each neuron's incoming weights by their Euclidean norm.

    A row of zeros (or one whose squares underflow to zero) stays as it is, with finite gradients.

    Args:
        weights: (*P, out, in).

    Returns:
        New weights, (*P, out, in), each row of norm 1 or 0.
    """
    squares = (weights * weights).sum(-1, keepdim=True)
    # The inner `where` keeps sqrt away from 0, where its gradient is infinite.
    return weights / torch.where(squares > 0, squares, 1.0).sqrt()


BOUNDS: dict[str | None, Callable[[Tensor], Tensor] | None] = {None: None, "l2": l2_normalize}


def bound_named(normalize: str | None) -> Callable[[Tensor], Tensor] | None:
    """The bound called `normalize`, or None for unbounded weights.

    Raises:
        ValueError: the name is unknown.
    """
    if normalize not in BOUNDS:
        raise ValueError(f"normalize: expected None or 'l2', got {normalize!r}")
    return BOUNDS[normalize]
