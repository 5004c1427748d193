"""Many environments that step together: tensors in, tensors out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
import torch
from gymnasium.spaces import Box
from gymnasium.utils.seeding import np_random
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from torch import Tensor

from physics import checks
from physics.envs.arguments import choice, reset_mask, seeds_of_worlds, spaces
from physics.envs.pictures import picture
from physics.envs.tasks import Ground, Task, finite_reward, task_of
from physics.envs.terrains import Terrains
from physics.scene.material import DT
from physics.scene.terrain import Terrain
from physics.simulator import Simulator
from physics.worlds.selection import chosen_worlds

__all__ = ["VoxelVectorEnv"]

_AHEAD = 32  # episodes that are worked out together
_MODES = {"same_step": AutoresetMode.SAME_STEP, "disabled": AutoresetMode.DISABLED}


class VoxelVectorEnv(VectorEnv):
    """N worlds with one soft robot each, in the conventions of Gymnasium's VectorEnv.

    Observations are the robot's readings, (N, R); actions the actuation of its voxels, (N, V) in
    [-1, 1]. An episode is *truncated* when its time is over, and *terminated* when the simulation
    of its world has failed or the robot has left the ground. Every returned tensor is the caller's
    own. World i of seed s is the world of a single environment (`VoxelEnv`) with seed s + i.

    Attributes:
        sim: the simulator, to look at or to ask more of.
        task: what is rewarded.
        episode_steps: control steps of an episode.
        device: The device of all tensors.
    """

    single_observation_space: Box
    single_action_space: Box

    def __init__(
        self,
        shape: Any = "biped-4x3",
        terrain: Ground | None = None,
        num_envs: int = 1,
        sensors: Any = "medium",
        episode: float = 15.0,
        *,
        task: str | Task = "locomotion",
        noise: float | Mapping[str, float] = 0.0,
        autoreset: Literal["same_step", "disabled"] = "same_step",
        arrays: Literal["torch", "numpy"] = "torch",
        render_mode: str | None = None,
        **settings: Any,
    ) -> None:
        """Makes the worlds.

        Args:
            shape: The shape of the robot: a name, a 2-D 0/1 array or a Morphology; or a list of N,
                one for each world. All worlds then have the spaces of the largest robot: readings
                that another lacks are 0, and actions for voxels that it lacks do nothing.
            terrain: a Terrain, its full name, or a name that leaves the seed open ("hilly-3-30") or
                a function from a seed to a Terrain, which give every episode a terrain of its
                own; None: the task's.
            num_envs: The number of environments, N.
            sensors: "low", "medium", "high" or an Apparatus, for a list of shapes also a list of N;
                at least one reading.
            episode: length of an episode [s].
            task: "locomotion", "jumping", "climbing", or a Task.
            noise: standard deviation of the readings' noise, in units of each sensor's range; or
                one for each kind of sensor, as for `Simulator`.
            autoreset: "same_step": an episode that ends is followed by the next one within the same
                call, and its last observation is in `infos["final_obs"]`. "disabled": the caller
                resets, `reset(options={"reset_mask": mask})`.
            arrays: what is returned, torch tensors or numpy arrays; both are taken.
            render_mode: None, or "rgb_array" for `render`.
            settings: further arguments of `Simulator`: gravity, friction, damage, control_interval,
                engine, dtype, device, threads.

        Raises:
            ValueError: an argument is not one of these; the message names it.
        """
        self.task = task_of(task)
        self.num_envs = checks.positive_integer("num_envs", num_envs)
        self._autoreset = choice("autoreset", autoreset, tuple(_MODES)) == "same_step"
        self._numpy = choice("arrays", arrays, ("torch", "numpy")) == "numpy"
        self.render_mode = choice("render_mode", render_mode, (None, "rgb_array"))
        self._terrains = Terrains(self.task.terrain if terrain is None else terrain)
        self._seeds = np.zeros(num_envs, dtype=np.uint64)
        self._episodes = np.zeros(num_envs, dtype=np.uint64)
        first = self._terrains.of_episodes(self._seeds, self._episodes)
        self.sim = Simulator(shape, first, self.num_envs, sensors=sensors, noise=noise, **settings)
        if self.sim.n_readings == 0:
            raise ValueError(f"sensors: expected at least one reading, got none from {sensors!r}")
        self.device = self.sim.device
        self._seconds = DT * self.sim.control_interval
        self.episode_steps = self.sim.control_steps(checks.finite("episode", episode, DT))
        self._age = np.zeros(num_envs, dtype=np.int64)  # control steps in the present episode
        self._prepared = np.zeros(num_envs, dtype=bool)  # whether the next episode is worked out
        self._before: Tensor | None = None
        self.metadata = {
            "render_modes": ["rgb_array"],
            "render_fps": max(1, round(1 / self._seconds)),
            "autoreset_mode": _MODES[autoreset],
        }
        self.single_observation_space, self.single_action_space = spaces(self.sim, noise)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """Begins episodes.

        Args:
            seed: world i gets seed + i; or one for each world. A world that gets none goes on with
                its next episode, whose terrain, noise and damage follow from its seed and the
                number of the episode; before its first one it draws a seed.
            options: {"reset_mask": mask}, (N,) bool, a tensor or an array: only these worlds.

        Returns:
            Observations of all worlds, (N, R), and infos.

        Raises:
            ValueError: the mask or the seeds are for other worlds, or another option is given.
        """
        chosen = chosen_worlds("reset_mask", reset_mask(options), self.num_envs)
        seeded = self._take_seeds(seed, chosen)
        return self._given(self._begin(chosen, seeded)), self._infos()

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """One control step.

        Args:
            actions: (N, V) in [-1, 1], clipped.

        Returns:
            Observations (N, R), rewards (N,), terminated (N,) bool, truncated (N,) bool, infos.

        Raises:
            ValueError: actions of another shape or not finite, or `reset` was never called.
        """
        if self._before is None:
            raise ValueError("step: expected a reset before the first step; call reset() first")
        readings = self.sim.step(torch.as_tensor(actions))
        after = self.task.look(self.sim)
        reward = finite_reward(self.task.reward(self._before, after, self._seconds))
        self._before = after
        self._age += 1
        failed, left = self.sim.ended()
        terminated = failed | left
        late = torch.from_numpy(self._age >= self.episode_steps).to(self.device)
        truncated = late & ~terminated
        observations = self._cleaned(readings, failed)
        infos = self._infos()
        over = terminated | truncated
        if self._autoreset and bool(over.any()):
            last = self._final(observations, infos, over)
            observations = self._begin(np.flatnonzero(over.cpu().numpy()), failed=failed & ~over)
            infos = {**last, **self._infos()}
        outputs = (observations, reward, terminated, truncated)
        return (*(self._given(each) for each in outputs), infos)

    def render(self) -> tuple[np.ndarray, ...] | None:
        """A picture of every world, (height, width, 3) uint8; None without a render_mode."""
        if self.render_mode is None:
            return None
        return tuple(picture(self.sim, world) for world in range(self.num_envs))

    def spread_phases(self, groups: int | None = None) -> None:
        """Ages the present episodes evenly, so that from now on they end one after the other.

        Args:
            groups: of neighbouring worlds that end together, of which group i of G is as old as if
                it had begun i / G of an episode ago; None: every world is one.

        Raises:
            ValueError: not an integer between 1 and N.
        """
        groups = checks.positive_integer("groups", self.num_envs if groups is None else groups)
        if groups > self.num_envs:
            raise ValueError(f"groups: expected at most {self.num_envs}, got {groups}")
        numbers = np.arange(self.num_envs) * groups // self.num_envs
        self._age[:] = numbers * self.episode_steps // groups

    def terrains(self) -> list[Terrain] | None:
        """The terrain of every world in its present episode."""
        return self.sim.terrains

    # --- episodes -------------------------------------------------------------------------------

    def _take_seeds(
        self, seed: int | Sequence[int | None] | None, chosen: np.ndarray
    ) -> np.ndarray:
        """Notes the seeds of some worlds; returns which of these worlds got one, (k,) bool."""
        if seed is None:
            seeds: list[int | None] = [None] * self.num_envs
        else:
            seeds = seeds_of_worlds(seed, self.num_envs)
            first = next((each for each in seeds if each is not None), None)
            self._np_random, self._np_random_seed = np_random(first)
        own = [seeds[world] for world in chosen]
        if self._before is None:  # worlds that never had one
            own = [int(self.np_random.integers(2**31)) if s is None else s for s in own]
        given = np.array([each is not None for each in own], dtype=bool)
        self._seeds[chosen[given]] = [each for each in own if each is not None]
        return given

    def _begin(
        self, chosen: np.ndarray, seeded: np.ndarray | None = None, failed: Tensor | None = None
    ) -> Tensor:
        """Begins episodes in some worlds; returns the observations of all.

        Args:
            chosen: numbers of k worlds.
            seeded: which of them have a new seed, (k,) bool; None: no one.
            failed: which of all worlds have failed then, (N,) bool; None: it is looked up.
        """
        if seeded is None or not seeded.any():
            parts = [(chosen, False)]
        else:
            parts = [(chosen[seeded], True), (chosen[~seeded], False)]
        readings: Tensor | None = self.sim.readings() if len(chosen) == 0 else None
        for worlds, is_new in parts:
            if len(worlds):
                readings = self._restart(worlds, is_new)
        self._before = self.task.look(self.sim)
        return self._cleaned(readings, self.sim.failed() if failed is None else failed)

    def _restart(self, chosen: np.ndarray, is_new: bool) -> Tensor | None:
        """Resets some worlds of the simulator, with their seeds if these are new."""
        seeds = None
        if is_new:
            seeds = [int(seed) for seed in self._seeds[chosen]]
            self._episodes[chosen] = 0
        else:
            if self._terrains.foreseen and not self._prepared[chosen].all():
                self._prepare(chosen)
            self._episodes[chosen] += self._age[chosen] > 0
        self._age[chosen] = 0
        self._prepared[chosen] = False
        terrains = None
        if self._terrains.varied:
            terrains = self._terrains.of_episodes(self._seeds[chosen], self._episodes[chosen])
        return self.sim.reset(self._mask(chosen), seeds=seeds, terrains=terrains)

    def _prepare(self, chosen: np.ndarray) -> None:
        """Works out the next episodes of some worlds, and of the oldest ones, which are about to
        need them: it is cheaper together."""
        oldest = np.argsort(-self._age, kind="stable")[: max(0, _AHEAD - len(chosen))]
        worlds = np.union1d(chosen, oldest)
        worlds = worlds[~self._prepared[worlds]]
        terrains = self._terrains.prepare(
            self._seeds[worlds], self._episodes[worlds] + np.uint64(1)
        )
        self.sim.prepare(self._mask(worlds), terrains if self._terrains.varied else None)
        self._prepared[worlds] = True

    def _mask(self, chosen: np.ndarray) -> np.ndarray:
        """Some worlds as a mask, (N,) bool."""
        mask = np.zeros(self.num_envs, dtype=bool)
        mask[chosen] = True
        return mask

    # --- what is returned -----------------------------------------------------------------------

    def _final(self, observations: Tensor, infos: dict[str, Any], over: Tensor) -> dict[str, Any]:
        """What infos tell of the worlds whose episode has just ended."""
        return {
            "final_obs": self._given(observations),
            "_final_obs": self._given(over),
            "final_info": infos,
            "_final_info": self._given(over.clone()),
        }

    def _infos(self) -> dict[str, Any]:
        """What else is known of the worlds: where their robots are."""
        return {"center": self._given(self.sim.center_of_mass())}

    def _cleaned(self, readings: Tensor | None, failed: Tensor) -> Tensor:
        """The readings, with 0 in worlds that have failed, where they are no numbers."""
        assert readings is not None
        return torch.where(failed[:, None], 0.0, readings) if bool(failed.any()) else readings

    def _given(self, values: Tensor) -> Any:
        """As the caller wants it."""
        return values.cpu().numpy() if self._numpy else values
