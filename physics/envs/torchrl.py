"""`VoxelVectorEnv` as an EnvBase of TorchRL (extra ``torchrl``)."""

from __future__ import annotations

from typing import Any

import torch
from tensordict import TensorDict, TensorDictBase
from torchrl.data import Binary, Bounded, Composite, Unbounded
from torchrl.envs import EnvBase

from physics.envs.vector import VoxelVectorEnv

__all__ = ["VoxelTorchRLEnv"]


class VoxelTorchRLEnv(EnvBase):
    """N worlds for TorchRL, with batch_size [N]; resets go by the mask "_reset".

    env = VoxelTorchRLEnv(shape="worm-7x1", num_envs=64)
    env.rollout(100, policy, break_when_any_done=False)

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
        worlds = VoxelVectorEnv(**{**settings, "arrays": "torch", "autoreset": "disabled"})
        n, sim = worlds.num_envs, worlds.sim
        super().__init__(device=worlds.device, batch_size=torch.Size([n]))
        self.worlds = worlds
        bounds = worlds.single_observation_space
        kind: dict[str, Any] = {"device": worlds.device, "dtype": sim.dtype}
        shape = (n, sim.n_readings)
        observation = (
            Bounded(0.0, 1.0, shape, **kind) if bounds.is_bounded() else Unbounded(shape, **kind)
        )
        self.observation_spec = Composite(observation=observation, shape=(n,))
        self.action_spec = Bounded(-1.0, 1.0, (n, sim.n_voxels), **kind)
        self.reward_spec = Unbounded((n, 1), **kind)
        flag = Binary(1, (n, 1), device=worlds.device, dtype=torch.bool)
        self.done_spec = Composite(
            done=flag, terminated=flag.clone(), truncated=flag.clone(), shape=(n,)
        )
        self._seed: int | None = None

    def _reset(self, tensordict: TensorDictBase | None = None, **kwargs: Any) -> TensorDictBase:
        mask = None if tensordict is None else tensordict.get("_reset", None)
        options = None if mask is None else {"reset_mask": mask.reshape(self.worlds.num_envs)}
        observations, _ = self.worlds.reset(seed=self._seed, options=options)
        self._seed = None
        done = torch.zeros(self.worlds.num_envs, 1, dtype=torch.bool, device=self.device)
        return self._packed({"observation": observations}, done, done.clone())

    def _step(self, tensordict: TensorDictBase) -> TensorDictBase:
        outputs = self.worlds.step(tensordict["action"])
        observations, reward, terminated, truncated, _ = outputs
        values = {"observation": observations, "reward": reward[:, None]}
        return self._packed(values, terminated[:, None], truncated[:, None])

    def _packed(
        self, values: dict[str, torch.Tensor], terminated: torch.Tensor, truncated: torch.Tensor
    ) -> TensorDict:
        ends = {
            "done": terminated | truncated,
            "terminated": terminated,
            "truncated": truncated,
        }
        return TensorDict({**values, **ends}, batch_size=self.batch_size, device=self.device)

    def _set_seed(self, seed: int | None) -> None:
        self._seed = seed
