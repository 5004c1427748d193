"""What an environment rewards, and the ground that goes with it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from physics.scene.material import SQUARE_HALF
from physics.scene.terrain import Terrain
from physics.simulator import Simulator

__all__ = ["TASKS", "Climbing", "Ground", "Jumping", "Locomotion", "Task", "stairs"]

Ground = Terrain | str | Callable[[int], Terrain]
"""A terrain; a name, which may leave its seed open ("hilly-3-30"); or a function from a seed to a
terrain. The last two give every episode a terrain of its own."""


class Task(ABC):
    """What is rewarded. Subclass it for a task of your own.

    A task looks at the worlds before and after each control step; `reward` gets both looks.
    """

    terrain: Ground = "hilly-3-30"
    """Ground on which it takes place, unless an environment is told another one."""

    @abstractmethod
    def look(self, sim: Simulator) -> Tensor:
        """What of the N worlds it is about, (N, ...)."""

    @abstractmethod
    def reward(self, before: Tensor, after: Tensor, seconds: float) -> Tensor:
        """Rewards of a control step, (N,).

        Args:
            before: what `look` returned before the step, (N, ...).
            after: what it returned after it.
            seconds: length of the step.
        """


@dataclass(frozen=True)
class Locomotion(Task):
    """Going to the right: the velocity of the centre along x [m/s]."""

    terrain: Ground = "hilly-3-30"

    def look(self, sim: Simulator) -> Tensor:
        """Centres of the robots [m], (N, 2)."""
        return sim.center_of_mass()

    def reward(self, before: Tensor, after: Tensor, seconds: float) -> Tensor:
        """Velocity along x [m/s], (N,)."""
        return (after[:, 0] - before[:, 0]) / seconds


@dataclass(frozen=True)
class Jumping(Task):
    """Leaving the ground: the height of the lowest square's centre above its place at rest on
    level ground [m]. A robot that stands still gets 0, once it has fallen from where it is placed.
    """

    terrain: Ground = "flat"
    level: float = 5.0
    """Height of the ground [m]; that of "flat"."""

    def look(self, sim: Simulator) -> Tensor:
        """Height of the lowest square [m], (N,)."""
        heights = sim.mass_poses()[..., 1]
        missing = ~sim.voxels_present()[..., None]
        return heights.masked_fill(missing, torch.inf).flatten(1).amin(1)

    def reward(self, before: Tensor, after: Tensor, seconds: float) -> Tensor:
        """Height above the place at rest [m], (N,), not negative."""
        return (after - (self.level + SQUARE_HALF)).clamp(min=0.0)


def stairs(seed: int) -> Terrain:
    """Stairs to climb: 25 m of level ground, then 150 steps with treads of 5 m.

    Args:
        seed: decides the rise of the steps, between 0.25 and 0.75 m, the same for all of them.
    """
    rise = 0.25 + 0.5 * float(np.random.default_rng(seed).random())
    steps, start, tread, ramp, wall = 150, 35.0, 5.0, 0.5, 100.0
    edges = start + tread * np.arange(steps)
    tops = rise * np.arange(1, steps + 1)
    xs = np.stack([edges - ramp, edges], 1).ravel()
    ys = np.stack([tops - rise, tops], 1).ravel()
    end = edges[-1] + tread
    return Terrain.from_profile(
        np.concatenate([[0.0, 10.0], xs, [end, end + 10.0]]),
        np.concatenate([[wall, 0.0], ys, [tops[-1], tops[-1] + wall]]),
        f"stairs-{rise:.2f}",
    )


@dataclass(frozen=True)
class Climbing(Task):
    """Climbing stairs: the velocity of the centre along x and upwards, added [m/s]."""

    terrain: Ground = stairs

    def look(self, sim: Simulator) -> Tensor:
        """Centres of the robots [m], (N, 2)."""
        return sim.center_of_mass()

    def reward(self, before: Tensor, after: Tensor, seconds: float) -> Tensor:
        """Velocity to the right and upwards [m/s], (N,)."""
        return (after - before).sum(1) / seconds


TASKS: dict[str, type[Task]] = {"locomotion": Locomotion, "jumping": Jumping, "climbing": Climbing}


def task_of(spec: str | Task) -> Task:
    """The task that a name or a Task stands for.

    Raises:
        ValueError: it is neither.
    """
    if isinstance(spec, Task):
        return spec
    if spec not in TASKS:
        raise ValueError(f"task: expected one of {', '.join(TASKS)} or a Task, got {spec!r}")
    return TASKS[spec]()


def finite_reward(reward: Tensor) -> Tensor:
    """The rewards, with 0 where a world has failed and they are no numbers."""
    return torch.nan_to_num(reward, nan=0.0, posinf=0.0, neginf=0.0)
