"""One environment, for libraries that take them one by one."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np

from physics.envs.vector import VoxelVectorEnv

__all__ = ["VoxelEnv"]


class VoxelEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """One world with a soft robot: `VoxelVectorEnv` of one world, with numpy arrays.

    Many worlds cost far less together than one by one: `gymnasium.make_vec` and `VoxelVectorEnv`.

    Attributes:
        worlds: the vector environment of one world behind it.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 60}  # noqa: RUF012  Gymnasium's form

    def __init__(self, shape: Any = "biped-4x3", **settings: Any) -> None:
        """Makes the world.

        Args:
            shape: The shape of the robot.
            settings: as of `VoxelVectorEnv`.

        Raises:
            ValueError: an argument is wrong; the message names it.
        """
        settings.setdefault("threads", 1)
        self.worlds = VoxelVectorEnv(
            shape, num_envs=1, autoreset="disabled", arrays="numpy", **settings
        )
        self.observation_space = self.worlds.single_observation_space
        self.action_space = self.worlds.single_action_space
        self.render_mode = self.worlds.render_mode
        self.metadata = {key: self.worlds.metadata[key] for key in ("render_modes", "render_fps")}

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begins an episode; see `VoxelVectorEnv.reset`.

        Args:
            seed: decides terrain, noise and damage of this and the following episodes.
            options: none are known.

        Returns:
            The observation, (R,), and infos.
        """
        super().reset(seed=seed)
        observations, infos = self.worlds.reset(seed=seed)
        return observations[0], _of_the_world(infos)

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """One control step; see `VoxelVectorEnv.step`.

        Args:
            action: (V,) in [-1, 1], clipped.

        Returns:
            Observation (R,), reward, terminated, truncated, infos.

        Raises:
            ValueError: an action of another shape or not finite.
        """
        outputs = self.worlds.step(np.asarray(action)[None])
        observations, reward, terminated, truncated, infos = outputs
        return (
            observations[0],
            float(reward[0]),
            bool(terminated[0]),
            bool(truncated[0]),
            _of_the_world(infos),
        )

    def render(self) -> np.ndarray | None:
        """A picture, (height, width, 3) uint8; None without a render_mode."""
        pictures = self.worlds.render()
        return None if pictures is None else pictures[0]


def _of_the_world(infos: dict[str, Any]) -> dict[str, Any]:
    return {key: value[0] for key, value in infos.items()}
