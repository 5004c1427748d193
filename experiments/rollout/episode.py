"""One life: a controller drives a robot from its birth to the end of the simulated time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import torch
from torch import Tensor

import hebbtorch
from experiments.rollout import fused
from experiments.rollout.controller import Controller
from physics import Simulator

__all__ = ["Life", "Loop", "Stepwise", "driver", "live"]

Loop = Literal["auto", "fused", "torch"]


@dataclass(frozen=True)
class Life:
    """What became of N robots.

    Attributes:
        speed: mean velocity along x [m/s], shape (N,), float64; NaN where the life failed.
        failed: whether the world became non-finite, shape (N,), bool.
        state: of the networks at the end.
        trace: robot's centre after each control step [m], shape (T, N, 2), if asked for.
    """

    speed: Tensor
    failed: Tensor
    state: hebbtorch.State
    trace: Tensor | None = None


@torch.no_grad()
def live(
    sim: Simulator,
    network: Controller,
    duration: float,
    *,
    state: hebbtorch.State | None = None,
    trace: bool = False,
    loop: Loop = "auto",
) -> Life:
    """Let N robots live.

    The first control step has zero actuation; what the networks answer to its readings acts in
    the next one. Speed is measured between the ends of the first and of the last step.

    Args:
        sim: N worlds; they are reset.
        network: N networks, with their genomes.
        duration: length of a life [s], rounded up to whole control steps.
        state: of the networks at birth; default: their initial state.
        trace: whether to keep the way of the robots' centres.
        loop: see `driver`.

    Raises:
        ValueError: the networks do not fit the worlds, or are none that "fused" knows.
    """
    state = network.initial_state() if state is None else state
    drive = driver(sim, network, state, loop)
    sim.reset()
    n_steps = sim.control_steps(duration)
    drive.run(sim, 1)
    start, birth = sim.center_of_mass().double(), sim.time
    way = [start]
    if trace:
        for _ in range(n_steps - 1):
            drive.run(sim, 1)
            way.append(sim.center_of_mass().double())
    else:
        drive.run(sim, n_steps - 1)
    failed = sim.failed()
    speed = (sim.center_of_mass().double() - start)[:, 0] / (sim.time - birth)
    return Life(
        speed=torch.where(failed, torch.nan, speed),
        failed=failed,
        state=drive.state(),
        trace=torch.stack(way) if trace else None,
    )


class Stepwise:
    """The control loop through PyTorch, for any network that is called as hebbtorch's are.

    It is the plain form of `fused.Brain`, which has the same methods.
    """

    def __init__(self, sim: Simulator, network: Controller, state: hebbtorch.State) -> None:
        self._network = network
        self._state = state
        self._actuation = torch.zeros(
            sim.n_worlds, sim.n_voxels, dtype=sim.dtype, device=sim.device
        )

    def run(self, sim: Simulator, steps: int) -> None:
        """Act, sense and think, for some control steps."""
        for _ in range(steps):
            readings = sim.step(self._actuation)
            assert readings is not None, "a controller needs readings"
            self._actuation, self._state = self._network(readings, self._state)

    def state(self) -> hebbtorch.State:
        """The weights as they are now."""
        return self._state


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


def driver(
    sim: Simulator, network: Controller, state: hebbtorch.State, loop: Loop = "auto"
) -> fused.Brain | Stepwise:
    """What makes N robots act, sense and think: `run(sim, steps)`, and their weights, `state()`.

    Args:
        sim: N worlds, newborn by the first step.
        network: N networks, with their genomes.
        state: of the networks at birth.
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
    return Stepwise(sim, network, state)
