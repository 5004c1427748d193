"""Takes down the course of one robot.

`record` lets an individual act as in the re-assessment on the terrain of the same seed; a loop of
one's own takes its course down with a `Recorder`.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

import hebbtorch
from experiments.analysis.trajectory import Trajectory
from experiments.config import EvolveConfig
from experiments.rollout.control_loop import ControlLoop
from experiments.rollout.episode import start_episode
from experiments.rollout.scenarios import Scenarios
from physics import DT, Simulator, steps_in

__all__ = ["Recorder", "record"]

_DEFAULT_START = 20.0  # [s]: by then plastic robots have learned to walk (paper, Fig. 6)
_NEVER = 1 << 60  # [steps]


@torch.inference_mode()
def record(
    config: EvolveConfig,
    genome: Tensor,
    *,
    seed: int = 0,
    start: float | None = None,
    seconds: float | None = None,
    every: int = 1,
    weights_every: float = math.inf,
    freeze_at: float = math.inf,
) -> Trajectory:
    """Let one individual act and record its course.

    Args:
        config: The options that the controller evolved under.
        genome: The champion's genome, shape (G,).
        seed: The seed of terrain, sensor noise, damage and initial weights.
        start: when the recording begins [s]; by default after the robot has learned to walk.
        seconds: length of the recording [s], cut at the end of the episode; by default all of it.
        every: control steps between two instants.
        weights_every: seconds between two looks at the weights.
        freeze_at: when learning stops [s].

    Raises:
        ValueError: start or seconds are out of range, or the simulation of this individual fails
            before the recording begins.
    """
    first, last = _window(config.duration, start, seconds)
    frozen_from = steps_in(freeze_at) if math.isfinite(freeze_at) else _NEVER
    first, last, frozen_from = (
        -(-step // config.control_interval) for step in (first, last, frozen_from)
    )
    config = replace(config, threads=1)  # one robot gains nothing from more
    scenarios = Scenarios.unseen(config.terrain, [seed])
    episode = start_episode(config, genome[None], scenarios)
    sim = episode.sim
    course = Recorder(sim, config=config, weights_every=weights_every)
    course.look_at_weights(0.0, episode.state())
    step = 0
    while step < last:
        # A step at a time where something is recorded, as many as possible before.
        ahead = every if step >= first - 1 else min(first - 1, frozen_from) - step
        if step < frozen_from:
            ahead = min(ahead, frozen_from - step)
        ahead = max(1, min(ahead, last - step))
        if step == frozen_from:
            episode.freeze()
        if ahead > 1:
            episode.run(ahead - 1)
        in_force, broken = sim.actuation(), sim.broken()
        episode.run(1)
        step += ahead
        if sim.failed()[0]:
            break
        if step >= first:
            course.add(actuation=in_force, broken=broken, loop=episode.loop)
        else:
            course.pass_by()
    if len(course.times) < 2:
        raise ValueError(
            f"start: expected a time before the simulation of this robot fails, got "
            f"{first * DT:.1f} s; choose an earlier one, or another seed"
        )
    return course.finish()


class Recorder:
    """Takes down the course of one world of a simulator.

    recorder = Recorder(sim, world=3)
    for _ in range(600):
        sim.step(actuation)
        recorder.add()
    trajectory_file.save(recorder.finish(), Path("course.safetensors"))
    """

    def __init__(
        self,
        sim: Simulator,
        world: int = 0,
        *,
        config: EvolveConfig | None = None,
        weights_every: float = math.inf,
    ) -> None:
        """Looks at where the robot is; the course begins with the first `add`.

        Args:
            sim: the simulator, with ground.
            world: number of the world.
            config: the conditions, if they are an evolution's.
            weights_every: seconds between two looks at the weights of a control loop.

        Raises:
            ValueError: there is no such world, or no ground.
        """
        if not 0 <= world < sim.n_worlds:
            raise ValueError(f"world: expected 0 to {sim.n_worlds - 1}, got {world}")
        if sim.terrains is None:
            raise ValueError("sim: expected worlds with ground, got none; give a terrain")
        self._sim = sim
        self._world = world
        self._config = config
        self._weights_every = weights_every
        self._body = sim.bodies.unlike[int(sim.bodies.of_world[world])]
        self.times: list[float] = []
        self._columns: list[tuple[np.ndarray, ...]] = []
        self._activations: list[tuple[np.ndarray, ...]] = []
        self._weight_times: list[float] = []
        self._weights: list[tuple[np.ndarray, ...]] = []
        self.pass_by()

    def pass_by(self) -> None:
        """Let an instant go unrecorded; the velocity of the next one is measured from it."""
        self._last = float(self._sim.times[self._world]), self._center()

    def add(
        self,
        reward: float | None = None,
        *,
        actuation: Tensor | None = None,
        broken: Tensor | None = None,
        loop: ControlLoop | None = None,
    ) -> None:
        """Take down one instant, after a control step.

        Args:
            reward: of the step; by default the velocity along x since the last instant [m/s].
            actuation: that was in force in the step, (N, V); by default that of the simulator,
                which is right after `Simulator.step`.
            broken: which voxels were broken in it, (N, V); by default those that are now.
            loop: whose activations and weights are taken down too.
        """
        sim, body = self._sim, self._body
        before, start = self._last
        self.pass_by()
        time, center = self._last
        v = body.n_voxels
        voxels = (
            sim.mass_poses(),
            sim.actuation() if actuation is None else actuation,
            sim.area_ratios(),
            sim.touching(),
            sim.broken() if broken is None else broken,
        )
        columns = [self._of_world(each)[:v] for each in voxels]
        columns.append(self._of_world(sim.readings())[: body.apparatus.n_readings])
        speed = (center - start) / max(time - before, 1e-9)
        columns.append(np.array(speed if reward is None else reward, dtype=np.float64))
        self.times.append(time)
        self._columns.append(tuple(columns))
        if activations := getattr(loop, "activations", None):
            self._activations.append(tuple(self._of_world(layer) for layer in activations()))
        if loop is not None and time >= len(self._weight_times) * self._weights_every - DT / 2:
            self.look_at_weights(time, loop.state())

    def look_at_weights(self, time: float, state: hebbtorch.State) -> None:
        """Take down weights."""
        if math.isfinite(self._weights_every):
            self._weight_times.append(time)
            self._weights.append(tuple(self._of_world(layer) for layer in state.weights))

    def finish(self) -> Trajectory:
        """All of it.

        Raises:
            ValueError: there are fewer than two instants.
        """
        if len(self.times) < 2:
            raise ValueError(f"recorder: expected at least two instants, got {len(self.times)}")
        poses, actuation, areas, touching, broken, readings, rewards = (
            np.stack(column) for column in zip(*self._columns, strict=True)
        )
        terrains = self._sim.terrains
        assert terrains is not None
        return Trajectory(
            config=self._config,
            morphology=self._body.morphology,
            terrain=terrains[self._world],
            apparatus=self._body.apparatus,
            seconds=DT * self._sim.control_interval,
            times=np.array(self.times),
            poses=poses,
            actuation=actuation,
            areas=areas,
            touching=touching,
            broken=broken,
            readings=readings,
            rewards=rewards,
            activations=tuple(np.stack(layer) for layer in zip(*self._activations, strict=True)),
            weight_times=np.array(self._weight_times),
            weights=tuple(np.stack(layer) for layer in zip(*self._weights, strict=True)),
        )

    def _center(self) -> float:
        return float(self._sim.center_of_mass()[self._world, 0])

    def _of_world(self, values: Tensor) -> np.ndarray:
        """What values (N, ...) are in the world, as an array (...) of its own."""
        return values[self._world].detach().cpu().numpy().copy()


def _window(duration: float, start: float | None, seconds: float | None) -> tuple[int, int]:
    """First and last engine step to record, from 1."""
    if seconds is not None and not seconds > 0:
        raise ValueError(f"seconds: expected a number > 0, got {seconds}")
    if start is None:
        start = 0.0 if seconds is None else max(0.0, min(_DEFAULT_START, duration - seconds))
    if not 0 <= start < duration:
        raise ValueError(f"start: expected a time within the episode of {duration} s, got {start}")
    end = duration if seconds is None else min(duration, start + seconds)
    first = max(1, round(start / DT))
    return first, max(steps_in(end), first + 1)
