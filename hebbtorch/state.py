"""Plastic weights as explicit state: created by a network, passed in, returned anew."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor


class State(NamedTuple):
    """What one plastic step changes: the synaptic weights.

    A tuple, hence a pytree: it passes through `torch.func` as it is. No method writes into it.

    Attributes:
        weights: one tensor (*batch, *P, out, in) per layer, from the inputs on, no unit.
    """

    weights: tuple[Tensor, ...]

    def reset(self, mask: Tensor, fresh: State) -> State:
        """The state in which the individuals in `mask` start again and the others go on.

        Args:
            mask: bool, (*batch, *P); True takes the weights from `fresh`.
            fresh: the weights to start from, as `initial_state()` of the network gives them, with
                all of this state's `batch` dimensions or the last ones.

        Raises:
            ValueError: the mask is not bool or not of that shape, or `fresh` is of another
                network, batch or dtype.
        """
        expected = self.weights[0].shape[:-2]
        if mask.dtype != torch.bool or mask.shape != expected:
            raise ValueError(
                f"mask: expected a bool tensor of shape {tuple(expected)}, "
                f"got {mask.dtype} of shape {tuple(mask.shape)}"
            )
        check_state(fresh, len(self.weights))
        for new, old in zip(fresh.weights, self.weights, strict=True):
            if not _fits(new, old):
                raise ValueError(
                    f"fresh: expected {old.dtype} weights of shape {tuple(old.shape)}, as this "
                    f"state has them, got {new.dtype} of shape {tuple(new.shape)}; "
                    f"take it from initial_state(batch=...) of the same network"
                )
        chosen = mask[..., None, None]
        return State(
            tuple(
                torch.where(chosen, new, old)
                for new, old in zip(fresh.weights, self.weights, strict=True)
            )
        )

    def detach(self) -> State:
        """The same weights without their autograd history."""
        return State(tuple(weights.detach() for weights in self.weights))

    def to(
        self, device: torch.device | str | None = None, dtype: torch.dtype | None = None
    ) -> State:
        """The same weights on another device or in another precision."""
        return State(tuple(weights.to(device=device, dtype=dtype) for weights in self.weights))


torch.serialization.add_safe_globals([State])  # torch.load reads one without further ado


def check_state(state: State, n_layers: int) -> None:
    """Check that a state has the weights of as many layers as the network.

    Raises:
        ValueError: it has not, or is something else.
    """
    came = f"those of {len(state.weights)}" if isinstance(state, State) else type(state).__name__
    if not isinstance(state, State) or len(state.weights) != n_layers:
        raise ValueError(
            f"state: expected the weights of {n_layers} layers, got {came}; "
            f"take the state from this network's initial_state()"
        )


def _fits(new: Tensor, old: Tensor) -> bool:
    """Whether weights can take the place of others, perhaps of several alike."""
    return new.dtype == old.dtype and new.shape == old.shape[old.dim() - new.dim() :]
