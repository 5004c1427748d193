"""Environments of other libraries, each by the library's own check."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import torch

from physics.envs import VoxelVectorEnv
from tests.physics.worlds import gaits

N = 4
SMALL: dict[str, Any] = {"shape": "worm-2x1", "sensors": "high", "episode": 0.5, "num_envs": N}
ACTIONS = gaits(40, N, 2).float()

# What these libraries do on import is theirs.
pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]


def expected(autoreset: str) -> list[Any]:
    env = VoxelVectorEnv(**SMALL, autoreset=autoreset)
    env.reset(seed=3)
    return [env.step(action) for action in ACTIONS]


def test_stable_baselines3() -> None:
    pytest.importorskip("stable_baselines3")
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import VecMonitor

    from physics.envs.sb3 import VoxelVecEnv

    env = VoxelVecEnv(**SMALL)
    env.seed(3)
    assert env.observation_space.contains(env.reset()[0])
    for action, wanted in zip(ACTIONS.numpy(), expected("same_step"), strict=True):
        observations, rewards, dones, infos = env.step(action)
        assert np.array_equal(observations, wanted[0].numpy())
        assert np.array_equal(rewards, wanted[1].numpy())
        assert np.array_equal(dones, (wanted[2] | wanted[3]).numpy())
        assert [info["TimeLimit.truncated"] for info in infos] == wanted[3].tolist()
        for world, info in enumerate(infos):
            assert ("terminal_observation" in info) == dones[world]
            if dones[world]:
                last = wanted[4]["final_obs"][world].numpy()
                assert np.array_equal(info["terminal_observation"], last)
    assert env.get_attr("num_envs", indices=[0, 2]) == [N, N]
    with pytest.raises(ValueError, match="set_attr: expected indices=None"):
        env.set_attr("task", None, indices=[1])
    PPO("MlpPolicy", VecMonitor(env), n_steps=40, batch_size=80, n_epochs=1).learn(160)


def test_torchrl() -> None:
    pytest.importorskip("torchrl")
    from torchrl.envs.utils import check_env_specs

    from physics.envs.torchrl import VoxelTorchRLEnv

    for noise in (0.0, 0.1):
        check_env_specs(VoxelTorchRLEnv(**SMALL, noise=noise))
    env = VoxelTorchRLEnv(**SMALL)
    env.set_seed(3)
    env.reset()
    for action, wanted in zip(ACTIONS[:31], expected("disabled")[:31], strict=True):
        found = env._step(env.full_action_spec.zero().set("action", action))
        assert torch.equal(found["observation"], wanted[0])
        assert torch.equal(found["reward"][:, 0], wanted[1])
        assert torch.equal(found["truncated"][:, 0], wanted[3])
    assert wanted[3].all()
    rollout = env.rollout(70, break_when_any_done=False)
    assert rollout.batch_size == (N, 70)
    assert rollout["next", "done"].sum(1).flatten().tolist() == [2] * N


def test_skrl() -> None:
    pytest.importorskip("skrl")
    from skrl.envs.wrappers.torch import Wrapper

    from physics.envs.skrl import VoxelSkrlEnv

    env = VoxelSkrlEnv(**SMALL)
    assert isinstance(env, Wrapper)
    assert (env.num_envs, env.device.type) == (N, "cpu")
    assert env.observation_space.shape == (11,)
    first, _ = env.reset()
    for action in ACTIONS:
        observations, reward, terminated, truncated, _ = env.step(action)
        assert torch.equal(env.reset()[0], observations)
        assert reward.shape == terminated.shape == truncated.shape == (N, 1)
    assert first.shape == observations.shape == (N, 11)


def test_skrl_wraps_and_trains() -> None:
    """skrl's own wrapper takes the worlds and sees the same; its agent learns on the adapter."""
    pytest.importorskip("skrl")
    from skrl.agents.torch.ppo import PPO
    from skrl.envs.wrappers.torch import wrap_env
    from skrl.memories.torch import RandomMemory
    from skrl.trainers.torch import SequentialTrainer
    from skrl.utils.model_instantiators.torch import deterministic_model, gaussian_model

    from physics.envs.skrl import VoxelSkrlEnv

    env = VoxelSkrlEnv(**SMALL)
    wrapped = wrap_env(VoxelVectorEnv(**SMALL), verbose=False)
    assert wrapped.num_envs == N
    env._worlds.reset(seed=3)
    wrapped._env.reset(seed=3)
    for action in ACTIONS[:5]:
        ours, theirs = env.step(action), wrapped.step(action)
        assert all(torch.equal(one, other) for one, other in zip(ours[:4], theirs[:4], strict=True))

    spaces = {
        "observation_space": env.observation_space,
        "action_space": env.action_space,
        "device": env.device,
    }
    layers = [{"name": "net", "input": "OBSERVATIONS", "layers": [8], "activations": "elu"}]
    models = {
        "policy": gaussian_model(**spaces, network=layers, output="ACTIONS"),
        "value": deterministic_model(**spaces, network=layers, output="ONE"),
    }
    options = {
        "rollouts": 16,
        "learning_epochs": 1,
        "mini_batches": 2,
        "experiment": {"write_interval": 0, "checkpoint_interval": 0},
    }
    memory = RandomMemory(memory_size=16, num_envs=N, device=env.device)
    agent = PPO(models=models, memory=memory, cfg=options, **spaces)
    quiet = {"headless": True, "disable_progressbar": True, "close_environment_at_exit": False}
    trainer = SequentialTrainer(env=env, agents=agent, cfg={"timesteps": 20, **quiet})
    trainer.train()
    before = [parameter.clone() for parameter in models["policy"].parameters()]
    trainer.train()
    after = models["policy"].parameters()
    assert any(not torch.equal(one, other) for one, other in zip(before, after, strict=True))
