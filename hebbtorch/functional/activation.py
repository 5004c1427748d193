"""Activations of neurons, and the weighted sums that they act on."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor

Activation = Callable[[Tensor], Tensor]


def identity(x: Tensor) -> Tensor:
    """The input itself."""
    return x


def sigmoid(x: Tensor) -> Tensor:
    """1 / (1 + exp(-x)), by way of tanh: torch's own rounds the end of an array unlike the rest."""
    return 0.5 + 0.5 * torch.tanh(0.5 * x)


ACTIVATIONS: dict[str, Activation] = {
    "tanh": torch.tanh,
    "identity": identity,
    "relu": torch.relu,
    "sigmoid": sigmoid,
    "softsign": torch.nn.functional.softsign,
    "sign": torch.sign,
    "sin": torch.sin,
}


def activation_named(activation: str | Activation, name: str = "activation") -> Activation:
    """The elementwise function called so, or the callable itself.

    Args:
        activation: one of `ACTIVATIONS`, or a callable from a tensor to one of the same shape.
        name: The name of the argument, for the error's message.

    Raises:
        ValueError: the name is unknown.
    """
    if callable(activation):
        return activation
    if activation not in ACTIVATIONS:
        raise ValueError(
            f"{name}: expected a callable or one of {tuple(ACTIVATIONS)}, got {activation!r}"
        )
    return ACTIVATIONS[activation]


def weighted_sum(x: Tensor, weights: Tensor, bias: Tensor | None = None) -> Tensor:
    """W x + b, (*P, out), of x (*P, in), W (*P, out, in) and, if any, b (*P, out, 1).

    A product and a sum over the last, contiguous dimension: on the CPU the order of its terms
    depends on `in` alone, and not on the strides, which a product takes from its factors. matmul
    is hardly faster here, and its order changes with the batch.
    """
    total = (weights * x.unsqueeze(-2)).contiguous().sum(-1)
    return total if bias is None else total + bias.squeeze(-1)


def fitting_input(
    x: Tensor, weights: Tensor, n_in: int, n_out: int, population: tuple[int, ...]
) -> Tensor:
    """The inputs of a layer in the weights' dtype, once both are checked.

    Inputs of a lower floating precision, such as autocast's, are converted.

    Raises:
        ValueError: inputs and weights do not fit the layer and each other.
    """
    lead = tuple(weights.shape[:-2])
    if weights.shape[-2:] != (n_out, n_in) or lead[len(lead) - len(population) :] != population:
        raise ValueError(
            f"state: expected weights of shape (*batch, *{population}, {n_out}, {n_in}), "
            f"got {tuple(weights.shape)}; take the state from this network's initial_state()"
        )
    is_lower = (
        x.is_floating_point()
        and x.dtype != weights.dtype
        and torch.promote_types(x.dtype, weights.dtype) == weights.dtype
    )
    if tuple(x.shape) != (*lead, n_in) or (x.dtype != weights.dtype and not is_lower):
        raise ValueError(
            f"x: expected {weights.dtype} of shape {(*lead, n_in)}, as the state has it, "
            f"got {x.dtype} of shape {tuple(x.shape)}"
        )
    return x.to(weights.dtype) if is_lower else x
