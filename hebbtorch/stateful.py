"""The one place where plastic weights are buffers: `y = layer(x)` in plain PyTorch code."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any, Self, TypeVar

import torch
from torch import Tensor, nn

from hebbtorch.linear import HebbianLinear
from hebbtorch.mlp import HebbianMLP
from hebbtorch.sampling import Generators, Init
from hebbtorch.state import State, check_state

AnyModule = TypeVar("AnyModule", bound=nn.Module)


class Stateful(nn.Module):
    """Keeps the state of a plastic layer or network between calls.

    The weights are buffers `weights_0`, `weights_1`, ..., one per layer, and what rules remember
    are buffers such as `trace_0`, so that `state_dict` and `to` include them. Their autograd
    history is kept from call to call (the rules get their gradients through it): call `detach()`
    to cut it, or run under `torch.no_grad()`. A deep copy has the state without its history.

    Under DistributedDataParallel every process keeps its own state: the parameters' gradients
    are averaged, the buffers of a `Stateful` are left alone. Where it is a part of a larger
    module, pass that through `hebbtorch.keep_local` first.

    Under `torch.func` transforms pass the state explicitly, with the network alone: a
    transform forgets what a module assigns to its buffers.

    >>> layer = Stateful(HebbianMLP([3, 4, 2]))
    >>> layer(torch.rand(3)).shape, layer.weights_1.shape
    (torch.Size([2]), torch.Size([2, 4]))

    Args:
        network: what to run.
        init: initial weights, see `HebbianLinear`; None: those of the network.
        batch: further dimensions, to the left of the population's.
        generator: The generator of random initial weights, see `HebbianMLP.initial_state`.
    """

    def __init__(
        self,
        network: HebbianLinear | HebbianMLP,
        init: Init | None = None,
        *,
        batch: Sequence[int] = (),
        generator: Generators = None,
    ) -> None:
        super().__init__()
        self.network = network
        self.init = init
        self.batch = tuple(batch)
        self._names: list[str] = []
        self._keep(network.initial_state(init, batch=self.batch, generator=generator))

    @property
    def state(self) -> State:
        """The present state."""
        n_layers = sum(name.startswith("weights_") for name in self._names)
        memory: list[dict[str, Tensor]] = [{} for _ in range(n_layers)]
        for name in self._names[n_layers:]:
            item, _, layer = name.rpartition("_")
            memory[int(layer)][item] = getattr(self, name)
        weights = tuple(getattr(self, name) for name in self._names[:n_layers])
        return State(weights, tuple(memory) if any(memory) else ())

    @state.setter
    def state(self, state: State) -> None:
        now = self.state
        check_state(state, len(now.weights))
        came = [tuple(weights.shape) for weights in state.weights]
        if came != [tuple(weights.shape) for weights in now.weights]:
            raise ValueError(
                f"state: expected weights of shapes {[tuple(w.shape) for w in now.weights]}, got "
                f"{came}; take the state from this network's initial_state(batch={self.batch})"
            )
        self._keep(state)

    def _keep(self, state: State) -> None:
        """Make a state the buffers of this module."""
        items = {f"weights_{k}": weights for k, weights in enumerate(state.weights)}
        for layer, memory in enumerate(state.memory):
            items |= {f"{name}_{layer}": item for name, item in memory.items()}
        for name in set(self._names) - set(items):
            delattr(self, name)
        for name, item in items.items():
            if name in self._buffers:
                setattr(self, name, item)
            else:
                self.register_buffer(name, item)
        self._names = list(items)
        self._ddp_params_and_buffers_to_ignore = list(items)  # read by DistributedDataParallel

    def _load_from_state_dict(self, *args: Any, **kwargs: Any) -> None:
        # load_state_dict writes into buffers: give it ones that no State shares.
        for name in self._names:
            setattr(self, name, getattr(self, name).detach().clone())
        super()._load_from_state_dict(*args, **kwargs)

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        for name in self._names:  # autograd refuses to copy what has a history
            item = getattr(self, name)
            memo[id(item)] = item.detach().clone()
        copied = type(self).__new__(type(self))
        memo[id(self)] = copied
        copied.__dict__.update(copy.deepcopy(self.__dict__, memo))
        return copied

    def forward(
        self, x: Tensor, plastic: bool | Tensor = True, *, modulation: Tensor | None = None
    ) -> Tensor:
        """The output (*batch, *P, out) for x (*batch, *P, in); then the state changes."""
        state = self.state
        if not torch.is_inference_mode_enabled() and state.weights[0].is_inference():
            state = state.detach()
        y, self.state = self.network(x, state, plastic, modulation=modulation)
        return y

    def reset(self, mask: Tensor | None = None, *, generator: Generators = None) -> None:
        """Begin a new life.

        Args:
            mask: bool, (*batch, *P); the individuals to restart. None restarts all.
            generator: The generator of random initial weights, see `HebbianMLP.initial_state`.
        """
        fresh = self.network.initial_state(self.init, batch=self.batch, generator=generator)
        self.state = fresh if mask is None else self.state.reset(mask, fresh)

    def detach(self) -> None:
        """Cut the state's autograd history."""
        self.state = self.state.detach()


def keep_local(module: AnyModule) -> AnyModule:
    """Keep the states of all `Stateful`s in a module out of DistributedDataParallel's broadcasts.

    >>> model = keep_local(nn.Sequential(Stateful(HebbianMLP([3, 2]))))
    >>> # model = nn.parallel.DistributedDataParallel(model)

    Args:
        module: what is about to be given to DistributedDataParallel.

    Returns:
        The module itself.
    """
    names = set(getattr(module, "_ddp_params_and_buffers_to_ignore", ()))
    for prefix, part in module.named_modules():
        if isinstance(part, Stateful):
            names |= {f"{prefix}.{name}" if prefix else name for name in part._names}
    module._ddp_params_and_buffers_to_ignore = sorted(names)  # type: ignore[assignment]
    return module
