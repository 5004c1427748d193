"""`VoxelVectorEnv` as an environment of skrl (extra ``skrl``)."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from skrl.envs.wrappers.torch import Wrapper

from physics.envs.vector import VoxelVectorEnv

__all__ = ["VoxelSkrlEnv"]


class VoxelSkrlEnv(Wrapper):
    """N worlds for agents and trainers of skrl, which take it as an environment that is wrapped
    already. Tensors go through as they are: skrl's own wrapper of vector environments copies them.
    """

    def __init__(self, **settings: Any) -> None:
        """Makes the worlds.

        Args:
            settings: as of `VoxelVectorEnv`.

        Raises:
            ValueError: an argument is wrong; the message names it.
        """
        worlds = VoxelVectorEnv(**{**settings, "arrays": "torch", "autoreset": "same_step"})
        super().__init__(worlds)
        self._worlds = worlds
        self._last: tuple[torch.Tensor, dict[str, Any]] | None = None

    @property
    def observation_space(self) -> Any:
        """Of one world."""
        return self._worlds.single_observation_space

    @property
    def action_space(self) -> Any:
        """Of one world."""
        return self._worlds.single_action_space

    def reset(self) -> tuple[torch.Tensor, dict[str, Any]]:
        """Observations (N, R) and infos. Worlds begin anew by themselves when an episode ends, so
        that only the first call resets them."""
        if self._last is None:
            self._last = self._worlds.reset()
        return self._last

    def step(
        self, actions: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor, torch.Tensor, dict[str, Any]]:
        """One control step: observations (N, R), rewards, terminated and truncated (N, 1), infos.

        Args:
            actions: (N, V) in [-1, 1], clipped.
        """
        outputs = self._worlds.step(actions.detach())
        observations, reward, terminated, truncated, infos = outputs
        self._last = observations, infos
        return observations, reward[:, None], terminated[:, None], truncated[:, None], infos

    def state(self) -> None:
        """There is none besides the observations."""
        return

    def render(self) -> tuple[np.ndarray, ...] | None:
        """A picture of every world."""
        return self._worlds.render()

    def close(self) -> None:
        """Nothing to do."""
