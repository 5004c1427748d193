"""Plastic weights as explicit state: created by a network, passed in, returned anew."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import torch
from torch import Tensor
from torch.utils import _pytree

Memory = dict[str, Tensor]  # of one layer; every entry is (*batch, *P, rows, columns)


class State(NamedTuple):
    """What one plastic step changes: the synaptic weights, and what a rule remembers.

    A tuple, hence a pytree: it passes through `torch.func` as it is. No method writes into it.

    Attributes:
        weights: one tensor (*batch, *P, out, in) per layer, from the inputs on, no unit.
        memory: one dict per layer of what its rule remembers (running averages, eligibility
            traces, the activations of a recurrent cell), each (*batch, *P, rows, columns);
            empty for layers that remember nothing but their weights.
    """

    weights: tuple[Tensor, ...]
    memory: tuple[Memory, ...] = ()

    def reset(self, mask: Tensor, fresh: State) -> State:
        """The state in which the individuals in `mask` start again and the others go on.

        Args:
            mask: bool, (*batch, *P); True takes the individual from `fresh`.
            fresh: the state to start from, as `initial_state()` of the network gives it, with
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
        if [sorted(m) for m in fresh.memory] != [sorted(m) for m in self.memory]:
            raise ValueError(
                f"fresh: expected a memory of {[sorted(m) for m in self.memory]}, as this state "
                f"has it, got {[sorted(m) for m in fresh.memory]}; take it from "
                f"initial_state(batch=...) of the same network"
            )
        chosen = mask[..., None, None]
        return State(
            tuple(
                torch.where(chosen, new, old)
                for new, old in zip(fresh.weights, self.weights, strict=True)
            ),
            tuple(
                {name: torch.where(chosen, new[name], old[name]) for name in old}
                for new, old in zip(fresh.memory, self.memory, strict=True)
            ),
        )

    def detach(self) -> State:
        """The same state without its autograd history, usable outside of inference mode."""
        return self._map(_detached)

    def to(
        self, device: torch.device | str | None = None, dtype: torch.dtype | None = None
    ) -> State:
        """The same state on another device or in another precision."""
        return self._map(
            lambda t: t.to(device=device, dtype=dtype if t.is_floating_point() else None)
        )

    def _map(self, function: Callable[[Tensor], Tensor]) -> State:
        return State(
            tuple(function(weights) for weights in self.weights),
            tuple({name: function(item) for name, item in m.items()} for m in self.memory),
        )


torch.serialization.add_safe_globals([State])  # torch.load reads one without further ado
_pytree._register_namedtuple(State, serialized_type_name="hebbtorch.State")  # torch.export.save


def memory_of(state: State, layer: int) -> Memory:
    """What a layer remembers; nothing where the state holds no memory."""
    return state.memory[layer] if state.memory else {}


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


def _detached(tensor: Tensor) -> Tensor:
    """Cut from autograd; a copy where a tensor of inference mode would refuse later training."""
    cut = tensor.detach()
    return cut.clone() if cut.is_inference() and not torch.is_inference_mode_enabled() else cut


def _fits(new: Tensor, old: Tensor) -> bool:
    """Whether weights can take the place of others, perhaps of several alike."""
    return new.dtype == old.dtype and new.shape == old.shape[old.dim() - new.dim() :]
