"""The control loop: step by step through PyTorch, or inside the simulator's kernel."""

from __future__ import annotations

import logging
from typing import Literal

import torch

import hebbtorch
from experiments.rollout import fused
from experiments.rollout.controller import Controller
from experiments.rollout.fused.team import FusedTeamLoop, pack_team
from experiments.rollout.team import Team, TorchTeamLoop
from physics import Simulator

__all__ = ["ControlLoop", "Loop", "TorchLoop", "control_loop"]

Loop = Literal["auto", "fused", "torch"]

_said: set[str] = set()  # reasons for the torch loop that were given


class TorchLoop:
    """The control loop through PyTorch, for any network that is called as hebbtorch's are.

    It is the plain form of `fused.FusedLoop`, which has the same methods.
    """

    def __init__(self, sim: Simulator, network: Controller, state: hebbtorch.State) -> None:
        self._network = network
        self._state = state
        self._plastic = True
        self._actuation = torch.zeros(
            sim.n_worlds, sim.n_voxels, dtype=sim.dtype, device=sim.device
        )

    def run(self, sim: Simulator, steps: int, monitor: hebbtorch.Monitor | None = None) -> None:
        """Act, sense and compute the next actuation, for some control steps.

        Args:
            sim: The simulator of the worlds.
            steps: The number of control steps.
            monitor: A monitor of this network; nothing is to be done here, for its hooks see every
                step.
        """
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


ControlLoop = fused.FusedLoop | TorchLoop | FusedTeamLoop | TorchTeamLoop


def control_loop(
    sim: Simulator, network: Controller | Team, state: hebbtorch.State, loop: Loop = "auto"
) -> ControlLoop:
    """What makes N robots act, sense and learn: `run(sim, steps)`, and their weights, `state()`.

    Args:
        sim: N worlds, just reset.
        network: N networks, with their genomes; a team where robots differ.
        state: The initial state of the networks.
        loop: "fused" runs the networks within the simulator's kernel, "torch" step by step;
            "auto" is "fused" where the kernel knows all that a network does (else it says once
            why not). They agree but for rounding.

    Raises:
        ValueError: the networks do not fit the worlds, or are none that "fused" knows.
    """
    if isinstance(network, Team):
        parts = zip(network.networks, network.split(state), strict=True)
        reason = next((words for part in parts if (words := fused.why_not(*part))), None)
    else:
        reason = fused.why_not(network, state)
    if loop == "fused" and reason:
        raise ValueError(
            f"loop: expected auto or torch for what the kernel does not know, got fused for "
            f"{type(network).__name__}: {reason}"
        )
    in_kernel = loop != "torch" and not reason
    if not in_kernel and loop == "auto" and reason not in _said:
        _said.add(str(reason))
        logging.getLogger(__name__).warning("control through PyTorch, step by step: %s", reason)
    if isinstance(network, Team):
        return (pack_team if in_kernel else TorchTeamLoop)(sim, network, state)
    return (fused.pack if in_kernel else TorchLoop)(sim, network, state)
