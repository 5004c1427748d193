"""The control loop: step by step through PyTorch, or inside the simulator's kernel."""

from __future__ import annotations

from typing import Literal

import torch

import hebbtorch
from experiments.rollout import fused
from experiments.rollout.controller import Controller
from physics import Simulator

__all__ = ["ControlLoop", "Loop", "TorchLoop", "control_loop"]

Loop = Literal["auto", "fused", "torch"]


class TorchLoop:
    """The control loop through PyTorch, for any network that is called as hebbtorch's are.

    It is the plain form of `fused.Brain`, which has the same methods.
    """

    def __init__(self, sim: Simulator, network: Controller, state: hebbtorch.State) -> None:
        self._network = network
        self._state = state
        self._plastic = True
        self._actuation = torch.zeros(
            sim.n_worlds, sim.n_voxels, dtype=sim.dtype, device=sim.device
        )

    def run(self, sim: Simulator, steps: int) -> None:
        """Act, sense and compute the next actuation, for some control steps."""
        for _ in range(steps):
            readings = sim.step(self._actuation)
            assert readings is not None, "a controller needs readings"
            alive = sim.alive()  # worlds that are over learn no more
            plastic = self._plastic if bool(alive.all()) else alive & self._plastic
            self._actuation, self._state = self._network(readings, self._state, plastic=plastic)

    def freeze(self) -> None:
        """End learning: from now on the weights stay as they are."""
        self._plastic = False

    def state(self) -> hebbtorch.State:
        """The weights as they are now."""
        return self._state


ControlLoop = fused.Brain | TorchLoop


def control_loop(
    sim: Simulator, network: Controller, state: hebbtorch.State, loop: Loop = "auto"
) -> ControlLoop:
    """What makes N robots act, sense and learn: `run(sim, steps)`, and their weights, `state()`.

    Args:
        sim: N worlds, just reset.
        network: N networks, with their genomes.
        state: The initial state of the networks.
        loop: "fused" runs the networks within the simulator's kernel, "torch" step by step;
            "auto" is "fused" for hebbtorch's own networks. They agree but for rounding.

    Raises:
        ValueError: the networks do not fit the worlds, or are none that "fused" knows.
    """
    is_own = _is_own(network) and not state.memory
    if loop == "fused" and not is_own:
        raise ValueError(
            "loop: expected auto or torch for a network that is not hebbtorch's own, got fused "
            f"for {type(network).__name__}"
        )
    if is_own and loop != "torch":
        return fused.pack(sim, network, state)
    return TorchLoop(sim, network, state)


def _is_own(network: Controller) -> bool:
    """Whether the kernel computes what the network does: nothing in it is overridden."""
    if type(network) is hebbtorch.StaticMLP:
        activations = (network.activation, network.output_activation, network.input_activation)
        return not network.biases and activations == ("tanh", "tanh", "identity")
    return (
        type(network) is hebbtorch.HebbianMLP
        and not network.constant_last_input
        and all(type(layer) is hebbtorch.HebbianLinear for layer in network.layers)
        and all(_is_plain(layer) for layer in network.layers)
        and len({layer.normalize for layer in network.layers}) == 1
    )


def _is_plain(layer: hebbtorch.HebbianLinear) -> bool:
    """Whether a layer has none of the features that the kernel lacks."""
    return (
        layer.rules.rule == hebbtorch.RULES["abcd"]
        and layer.plasticity == hebbtorch.HebbianLinear(1, 1, normalize=layer.normalize).plasticity
        and layer.normalize in (None, "l2", "minmax")
        and layer.activation == "tanh"
        and layer.bias is None
        and layer.fixed is None
    )
