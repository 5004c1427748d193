"""The networks of worlds with different robots: a population for each robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

import hebbtorch
from experiments.config import EvolveConfig
from experiments.rollout import controller
from experiments.rollout.controller import Controller
from hebbtorch.state import Memory
from physics import Bodies, Body, Simulator

__all__ = ["Team", "TorchTeamLoop", "gene_counts", "refuse"]


def gene_counts(config: EvolveConfig, bodies: Bodies) -> list[int]:
    """Genes of the controller of each world's robot, N of them.

    Args:
        config: The options of the evolution.
        bodies: The robots.
    """
    unlike = [_build(config, body, 1).n_genes for body in bodies.unlike]
    return [unlike[number] for number in bodies.of_world.tolist()]


def _build(config: EvolveConfig, body: Body, count: int) -> Controller:
    return controller.build(config, count, body.morphology, body.apparatus)


def refuse(monitor: hebbtorch.Monitor | None) -> None:
    """Raises ValueError if there is a monitor, which looks at one network only."""
    if monitor is not None:
        raise ValueError("monitor: expected None where worlds have different robots; record them")


@dataclass(frozen=True)
class Team:
    """Networks of N worlds, robot by robot.

    Its state is one `hebbtorch.State` with the layers of all robots' networks, one after the other.

    Attributes:
        networks: A population for each of the robots that differ.
        worlds: The numbers of the worlds that have each robot, in the order of its population.
    """

    networks: tuple[Controller, ...]
    worlds: tuple[np.ndarray, ...]

    @classmethod
    def of(cls, config: EvolveConfig, bodies: Bodies, genomes: Sequence[Tensor]) -> Team:
        """The networks of genomes.

        Args:
            config: The options of the evolution.
            bodies: The robots of N worlds.
            genomes: One for each world, each of the length that its robot needs.

        Raises:
            ValueError: a genome has another length.
        """
        networks, worlds = [], []
        for number, body in enumerate(bodies.unlike):
            own = np.flatnonzero(bodies.of_world == number)
            network = _build(config, body, len(own))
            for world in own.tolist():
                if tuple(genomes[world].shape) != (network.n_genes,):
                    raise ValueError(
                        f"genomes: expected {network.n_genes} genes for the robot of world "
                        f"{world}, got shape {tuple(genomes[world].shape)}"
                    )
            network.set_genomes(torch.stack([genomes[world] for world in own.tolist()]))
            networks.append(network)
            worlds.append(own)
        return cls(tuple(networks), tuple(worlds))

    def initial_state(self, init: str, seeds: Sequence[int]) -> hebbtorch.State:
        """The state at the beginning of an episode; see `controller.initial_state`.

        Args:
            init: How the weights begin.
            seeds: One for each world.
        """
        states = [
            controller.initial_state(network, init, [seeds[world] for world in own.tolist()])
            for network, own in zip(self.networks, self.worlds, strict=True)
        ]
        return self.joined(states)

    def zeros(self) -> hebbtorch.State:
        """The state of networks that have learned nothing."""
        return self.joined([network.initial_state() for network in self.networks])

    @staticmethod
    def joined(states: Sequence[hebbtorch.State]) -> hebbtorch.State:
        """The states of all populations as one."""
        weights = tuple(layer for state in states for layer in state.weights)
        memory: tuple[Memory, ...] = ()
        if any(state.memory for state in states):
            memory = tuple(
                dict(layer)
                for state in states
                for layer in state.memory or [{}] * len(state.weights)
            )
        return hebbtorch.State(weights, memory)

    def split(self, state: hebbtorch.State) -> list[hebbtorch.State]:
        """The state of each population; undoes `joined`."""
        states, first = [], 0
        for network in self.networks:
            last = first + len(network.sizes) - 1
            states.append(hebbtorch.State(state.weights[first:last], state.memory[first:last]))
            first = last
        return states


class TorchTeamLoop:
    """The control loop of a team through PyTorch, with the methods of `TorchLoop`."""

    def __init__(self, sim: Simulator, team: Team, state: hebbtorch.State) -> None:
        self._team = team
        self._states = team.split(state)
        self._where = [torch.from_numpy(own).to(sim.device) for own in team.worlds]
        self._plastic = True
        self._actuation = torch.zeros(
            sim.n_worlds, sim.n_voxels, dtype=sim.dtype, device=sim.device
        )

    def run(self, sim: Simulator, steps: int, monitor: hebbtorch.Monitor | None = None) -> None:
        """Act, sense and compute the next actuation, for some control steps."""
        refuse(monitor)
        for _ in range(steps):
            readings = sim.step(self._actuation)
            assert readings is not None, "controllers need readings"
            plastic = sim.alive() & self._plastic  # worlds that are over learn no more
            for k, (network, where) in enumerate(
                zip(self._team.networks, self._where, strict=True)
            ):
                seen = readings[where, : network.sizes[0]]
                acts, self._states[k] = network(seen, self._states[k], plastic=plastic[where])
                self._actuation[where, : acts.shape[1]] = acts

    def freeze(self) -> None:
        """End learning: from now on the weights stay as they are."""
        self._plastic = False

    def state(self) -> hebbtorch.State:
        """The weights as they are now."""
        return self._team.joined(self._states)
