"""The forward pass of one layer, plastic or static."""

from __future__ import annotations

import torch
from torch import Tensor


def weighted_tanh(x: Tensor, weights: Tensor) -> Tensor:
    """tanh(W x), (*P, out), of x (*P, in) and W (*P, out, in).

    A product and a sum over the last, contiguous dimension: on the CPU the order of its terms
    depends on `in` alone, and not on the strides, which a product takes from its factors. matmul
    is hardly faster here, and its order changes with the batch.
    """
    return torch.tanh((weights * x.unsqueeze(-2)).contiguous().sum(-1))


def check_activation(
    x: Tensor, weights: Tensor, n_in: int, n_out: int, population: tuple[int, ...]
) -> None:
    """Check that inputs and weights fit a layer and each other.

    Raises:
        ValueError: they do not.
    """
    lead = tuple(weights.shape[:-2])
    if weights.shape[-2:] != (n_out, n_in) or lead[len(lead) - len(population) :] != population:
        raise ValueError(
            f"state: expected weights of shape (*batch, *{population}, {n_out}, {n_in}), "
            f"got {tuple(weights.shape)}; take the state from this network's initial_state()"
        )
    if tuple(x.shape) != (*lead, n_in) or x.dtype != weights.dtype:
        raise ValueError(
            f"x: expected {weights.dtype} of shape {(*lead, n_in)}, as the state has it, "
            f"got {x.dtype} of shape {tuple(x.shape)}"
        )
