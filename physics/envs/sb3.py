"""`VoxelVectorEnv` as a VecEnv of stable-baselines3 (extra ``sb3``)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import gymnasium
import numpy as np
from stable_baselines3.common.vec_env import VecEnv

from physics.envs.vector import VoxelVectorEnv

__all__ = ["VoxelVecEnv"]

_Indices = None | int | Iterable[int]


class VoxelVecEnv(VecEnv):
    """N worlds for algorithms of stable-baselines3.

    from stable_baselines3 import PPO
    model = PPO("MlpPolicy", VoxelVecEnv(shape="worm-7x1", num_envs=64)).learn(100_000)

    Rewards are float32; of an episode that ends, `infos[i]` holds "terminal_observation" and
    "TimeLimit.truncated".

    Attributes:
        worlds: the vector environment behind it.
    """

    def __init__(self, **settings: Any) -> None:
        """Makes the worlds.

        Args:
            settings: as of `VoxelVectorEnv`.

        Raises:
            ValueError: an argument is wrong; the message names it.
        """
        self.worlds = VoxelVectorEnv(**{**settings, "arrays": "numpy", "autoreset": "same_step"})
        self._actions: np.ndarray | None = None
        super().__init__(
            self.worlds.num_envs,
            self.worlds.single_observation_space,
            self.worlds.single_action_space,
        )

    def reset(self) -> np.ndarray:
        """Begins an episode in every world, with the seeds that `seed` was told, if it was."""
        observations, _ = self.worlds.reset(seed=self._seeds)
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: np.ndarray) -> None:
        """Takes note of actions (N, V)."""
        self._actions = actions

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Observations (N, R), rewards (N,), dones (N,) and infos, N dicts, of one control step."""
        observations, rewards, terminated, truncated, found = self.worlds.step(self._actions)
        infos: list[dict[str, Any]] = [
            {"TimeLimit.truncated": late, "center": center}
            for late, center in zip(truncated.tolist(), found["center"], strict=True)
        ]
        done = terminated | truncated
        for world in np.flatnonzero(done):
            infos[world]["terminal_observation"] = found["final_obs"][world]
            infos[world]["center"] = found["final_info"]["center"][world]
        return observations, rewards.astype(np.float32), done, infos

    def close(self) -> None:
        """Nothing to do."""

    def get_images(self) -> Sequence[np.ndarray | None]:
        """A picture of every world."""
        return self.worlds.render() or [None] * self.num_envs

    def get_attr(self, attr_name: str, indices: _Indices = None) -> list[Any]:
        """An attribute of the vector environment, once per world."""
        return [getattr(self.worlds, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: _Indices = None) -> None:
        """Sets an attribute of the vector environment, which all worlds share.

        Raises:
            ValueError: it is to be set for some of them.
        """
        if indices is not None and len(list(self._get_indices(indices))) != self.num_envs:
            raise ValueError(f"set_attr: expected indices=None, for all worlds, got {indices!r}")
        setattr(self.worlds, attr_name, value)

    def env_method(
        self, method_name: str, *args: Any, indices: _Indices = None, **kwargs: Any
    ) -> list[Any]:
        """Calls a method of the vector environment once; its result, once per world."""
        result = getattr(self.worlds, method_name)(*args, **kwargs)
        return [result for _ in self._get_indices(indices)]

    def env_is_wrapped(
        self, wrapper_class: type[gymnasium.Wrapper], indices: _Indices = None
    ) -> list[bool]:
        """Whether each world is wrapped: no."""
        return [False for _ in self._get_indices(indices)]
