"""The one place where plastic weights are buffers: `y = layer(x)` in plain PyTorch code."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from torch import Tensor, nn

from hebbtorch.linear import HebbianLinear
from hebbtorch.mlp import HebbianMLP
from hebbtorch.sampling import Generators
from hebbtorch.state import State, check_state


class Stateful(nn.Module):
    """Keeps the state of a plastic layer or network between calls.

    The weights are buffers `weights_0`, `weights_1`, ..., one per layer, so that `state_dict`
    and `to` include them. Their autograd history is kept from call to call (the rules get their
    gradients through it): call `detach()` to cut it, or run under `torch.no_grad()`.

    Under `torch.func` transforms pass the state explicitly, with the network alone: a
    transform forgets what a module assigns to its buffers.

    Args:
        network: what to run.
        init: weights at birth, "zeros" or "uniform".
        batch: further dimensions, to the left of the population's.
        generator: for "uniform", see `HebbianMLP.initial_state`.
    """

    def __init__(
        self,
        network: HebbianLinear | HebbianMLP,
        init: str = "zeros",
        *,
        batch: Sequence[int] = (),
        generator: Generators = None,
    ) -> None:
        super().__init__()
        self.network = network
        self.init = init
        self.batch = tuple(batch)
        state = network.initial_state(init, batch=self.batch, generator=generator)
        self._names = [f"weights_{index}" for index in range(len(state.weights))]
        for name, weights in zip(self._names, state.weights, strict=True):
            self.register_buffer(name, weights)

    @property
    def state(self) -> State:
        """The present state."""
        return State(tuple(getattr(self, name) for name in self._names))

    @state.setter
    def state(self, state: State) -> None:
        now = [getattr(self, name) for name in self._names]
        check_state(state, len(now))
        came = [tuple(weights.shape) for weights in state.weights]
        if came != [tuple(weights.shape) for weights in now]:
            raise ValueError(
                f"state: expected weights of shapes {[tuple(w.shape) for w in now]}, got {came}; "
                f"take the state from this network's initial_state(batch={self.batch})"
            )
        for name, weights in zip(self._names, state.weights, strict=True):
            setattr(self, name, weights)

    def _load_from_state_dict(self, *args: Any, **kwargs: Any) -> None:
        # load_state_dict writes into buffers: give it ones that no State shares.
        for name in self._names:
            setattr(self, name, getattr(self, name).detach().clone())
        super()._load_from_state_dict(*args, **kwargs)

    def forward(self, x: Tensor, plastic: bool = True) -> Tensor:
        """The output (*batch, *P, out) for x (*batch, *P, in); then the weights change."""
        y, self.state = self.network(x, self.state, plastic=plastic)
        return y

    def reset(self, mask: Tensor | None = None, *, generator: Generators = None) -> None:
        """Begin a new life.

        Args:
            mask: bool, (*batch, *P); the individuals to restart. None restarts all.
            generator: for init="uniform", see `HebbianMLP.initial_state`.
        """
        fresh = self.network.initial_state(self.init, batch=self.batch, generator=generator)
        self.state = fresh if mask is None else self.state.reset(mask, fresh)

    def detach(self) -> None:
        """Cut the weights' autograd history."""
        self.state = self.state.detach()
