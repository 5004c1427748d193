"""One episode: controllers drive robots from their initial state to the end of simulated time.

episode = start_episode(config, genomes, Scenarios.unseen(config.terrain, [0, 1, 2]))
outcome = episode.finish()  # or episode.run(steps), and look at episode.sim meanwhile
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

import hebbtorch
from experiments.config import EvolveConfig
from experiments.rollout import controller
from experiments.rollout.control_loop import Loop, control_loop
from experiments.rollout.controller import Controller
from experiments.rollout.scenarios import Scenarios, damage
from experiments.rollout.team import Team
from physics import Apparatus, Morphology, Simulator

__all__ = ["Episode", "Outcome", "simulator", "start_episode"]


@dataclass(frozen=True)
class Outcome:
    """What came out for N robots.

    Attributes:
        speed: Mean velocity along x [m/s], shape (N,), float64; NaN where the world failed.
        failed: Whether the world became non-finite, shape (N,), bool.
        state: The networks' state at the end.
        trace: The robots' centres after each control step [m], shape (T, N, 2), if asked for.
    """

    speed: Tensor
    failed: Tensor
    state: hebbtorch.State
    trace: Tensor | None = None


class Episode:
    """N robots at the beginning of their episodes, and then as far as they were run.

    The first control step has zero actuation; what the networks answer to its readings acts in
    the next one. Speed is measured between the ends of the first and of the last step; a robot
    that leaves the ground's ends stops there, and its speed is the mean up to then.

    Attributes:
        sim: The N worlds; they are reset.
        network: The N networks, with their genomes; a team where robots differ.
        n_steps: Control steps of the whole episode.
        steps_done: Control steps so far.
        loop: What drives the robots.
    """

    def __init__(
        self,
        sim: Simulator,
        network: Controller | Team,
        duration: float,
        *,
        state: hebbtorch.State | None = None,
        loop: Loop = "auto",
    ) -> None:
        """Reset the worlds, and hand the robots to their networks.

        Args:
            sim: A simulator of N worlds.
            network: N networks, with their genomes.
            duration: Length of the episode [s], rounded up to whole control steps.
            state: The state of the networks at the beginning; by default nothing is learned.
            loop: See `control_loop`.

        Raises:
            ValueError: the networks do not fit the worlds, or are none that "fused" knows.
        """
        self.sim = sim
        self.network = network
        self.n_steps = sim.control_steps(duration)
        self.steps_done = 0
        if state is None:
            state = network.zeros() if isinstance(network, Team) else network.initial_state()
        self.loop = control_loop(sim, network, state, loop)
        if not sim.at_start:
            sim.reset()
        self._first: tuple[Tensor, float] | None = None

    @torch.no_grad()
    def run(self, steps: int, monitor: hebbtorch.Monitor | None = None) -> None:
        """Go on for some control steps.

        Args:
            steps: The number of control steps.
            monitor: A monitor of the network, which is filled.
        """
        if self._first is None and steps > 0:
            self.loop.run(self.sim, 1, monitor)
            self._first = self._center(), self.sim.time
            self.steps_done, steps = 1, steps - 1
        self.loop.run(self.sim, steps, monitor)
        self.steps_done += steps

    def freeze(self) -> None:
        """End learning: from now on the weights stay as they are."""
        self.loop.freeze()

    def run_until(self, seconds: float) -> None:
        """Go on up to a time of the episode [s]."""
        self.run(self.sim.control_steps(seconds) - self.steps_done)

    @torch.no_grad()
    def speeds(self, ends: Sequence[float]) -> Tensor:
        """Go on part by part, and measure the speed within each.

        Args:
            ends: When the parts end [s], in order. The first begins now, but not before the end of
                the first step.

        Returns:
            Mean velocities along x [m/s], shape (N, parts), float64; NaN from the part on in which
            a world failed.
        """
        self.run(1 if self.steps_done == 0 else 0)
        found = []
        before, time = self._center()[:, 0], self.sim.time
        for end in ends:
            self.run_until(end)
            now = self._center()[:, 0]
            speed = (now - before) / (self.sim.time - time)
            found.append(torch.where(self.sim.failed(), torch.nan, speed))
            before, time = now, self.sim.time
        return torch.stack(found, -1)

    @torch.no_grad()
    def finish(self, *, trace: bool = False) -> Outcome:
        """Go on to the end.

        Args:
            trace: Whether to keep the robots' centres from now on, step by step.
        """
        self.run(1 if self.steps_done == 0 else 0)
        way = [self._center()]
        if trace:
            while self.steps_done < self.n_steps:
                self.run(1)
                way.append(self._center())
        self.run(self.n_steps - self.steps_done)
        failed = self.sim.failed()
        return Outcome(
            speed=torch.where(failed, torch.nan, self._speed()),
            failed=failed,
            state=self.state(),
            trace=torch.stack(way) if trace else None,
        )

    def state(self) -> hebbtorch.State:
        """The state of the networks as it is now."""
        return self.loop.state()

    def _center(self) -> Tensor:
        return self.sim.center_of_mass().double()

    def _speed(self) -> Tensor:
        """Mean velocity along x since the end of the first step [m/s], shape (N,)."""
        assert self._first is not None
        center, start = self._first
        distance = (self._center() - center)[:, 0]
        left = self.sim.left_ground()
        time = torch.where(left, self.sim.times, self.sim.time) - start
        return torch.where(left & (time <= 0), 0.0, distance / time)


def start_episode(
    config: EvolveConfig,
    genomes: Tensor | Sequence[Tensor],
    scenarios: Scenarios,
    *,
    shape: Morphology | Sequence[Morphology] | None = None,
    sensors: str | Apparatus | Sequence[Apparatus] | None = None,
    network: Controller | None = None,
    **physics: Any,
) -> Episode:
    """Begin the episodes of individuals, each in a world of its own.

    Args:
        config: The conditions: shape, sensors, controller, noise, damage, duration and so on. Its
            terrain and seed do not count, since the scenarios have their own.
        genomes: One per individual, shape (N, G), or a list of N where their lengths differ.
        scenarios: What each individual meets, N of them.
        shape: A body in place of the options', or a list of N of them.
        sensors: An apparatus in place of the options', or a list of N of them.
        network: Networks of N individuals to use again, as `controller.build` made them.
        physics: Other keywords of `Simulator` in place of what the options say, such as engine,
            gravity or damage.

    Raises:
        ValueError: genomes and scenarios are not equally many, or the genomes do not fit.
    """
    if len(genomes) != len(scenarios):
        raise ValueError(
            f"scenarios: expected {len(genomes)}, one per genome, got {len(scenarios)}"
        )
    sim = simulator(config, scenarios, shape=shape, sensors=sensors, **physics)
    if not sim.bodies.alike:
        team = Team.of(config, sim.bodies, list(genomes))
        state = team.initial_state(config.init, scenarios.init_seeds)
        return Episode(sim, team, config.duration, state=state, loop=config.loop)
    if network is None:
        network = controller.build(config, len(genomes), sim.morphology, sim.apparatus)
    network.set_genomes(genomes if isinstance(genomes, Tensor) else torch.stack(list(genomes)))
    state = controller.initial_state(network, config.init, scenarios.init_seeds)
    return Episode(sim, network, config.duration, state=state, loop=config.loop)


def simulator(
    config: EvolveConfig,
    scenarios: Scenarios,
    *,
    shape: Morphology | Sequence[Morphology] | None = None,
    sensors: str | Apparatus | Sequence[Apparatus] | None = None,
    **physics: Any,
) -> Simulator:
    """The worlds of some scenarios, without controllers.

    Args:
        config: As for `start_episode`, like the rest.
        scenarios: What the worlds are, N of them.
        shape: A body in place of the options', or a list of N of them.
        sensors: An apparatus in place of the options', or a list of N of them.
        physics: Other keywords of `Simulator` in place of what the options say.
    """
    options: dict[str, Any] = {
        "noise": config.noises(),
        "control_interval": config.control_interval,
        "control_delay": config.control_delay,
        "actuation_cutoff": config.actuation_cutoff,
        "gravity": config.gravity,
        "friction": config.friction,
        "spring_frequency": config.spring_frequency,
        "spring_damping": config.spring_damping,
        "damage": damage(config, _least_voxels(config, shape)),
        "device": config.device,
        "threads": config.threads,
    }
    return Simulator(
        shape or config.shape,
        scenarios.terrains,
        n_worlds=len(scenarios),
        sensors=sensors or config.sensors,
        seed=scenarios.world_seeds,
        **(options | physics),
    )


def _least_voxels(config: EvolveConfig, shape: Morphology | Sequence[Morphology] | None) -> int:
    """Voxels of the robot, or of the smallest of several."""
    if shape is None:
        return Morphology.from_name(config.shape).n_voxels
    if isinstance(shape, Morphology):
        return shape.n_voxels
    return min(Morphology.of(each).n_voxels for each in shape)
