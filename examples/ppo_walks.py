"""PPO of stable-baselines3 learns to walk: a worm on level ground, episodes of 15 s.

Shows a robot of this project under somebody else's algorithm, through its VecEnv. Needs the extra
``rl``. Takes some five minutes on one core, and ends near 2 m/s.

    python examples/ppo_walks.py --steps 650000
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback

from physics.envs.sb3 import VoxelVecEnv


def worlds(num_envs: int) -> VoxelVecEnv:
    """Worms on level ground that feel their shape, their touch and their velocity."""
    return VoxelVecEnv(shape="worm-7x1", terrain="flat", num_envs=num_envs, sensors="medium")


def speed(model: PPO, seed: int = 1) -> float:
    """Mean velocity of the trained worm over an episode [m/s], without exploration."""
    env = worlds(8)
    env.seed(seed)
    observations, total = env.reset(), 0.0
    for _ in range(env.worlds.episode_steps):
        actions, _ = model.predict(observations, deterministic=True)
        observations, rewards, _, _ = env.step(actions)
        total += float(rewards.mean())
    return total / env.worlds.episode_steps


class Curve(BaseCallback):
    """Prints the velocity of each rollout, exploration included."""

    def __init__(self) -> None:
        super().__init__()
        self.rows: list[tuple[int, float]] = []

    def _on_rollout_end(self) -> None:
        reward = float(self.model.rollout_buffer.rewards.mean())
        self.rows.append((self.num_timesteps, reward))
        print(f"{self.num_timesteps:>8} steps  {reward:6.2f} m/s", flush=True)

    def _on_step(self) -> bool:
        return True


def main(arguments: Sequence[str] | None = None) -> float:
    """Trains, and returns the speed reached [m/s]."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=650_000, help="robot-steps of training")
    parser.add_argument("--envs", type=int, default=64, help="worlds side by side")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(arguments)
    torch.set_num_threads(1)
    model = PPO(
        "MlpPolicy",
        worlds(options.envs),
        n_steps=128,
        batch_size=1024,
        n_epochs=5,
        learning_rate=1e-3,
        use_sde=True,  # the same noise for 16 steps: a body of soft voxels hardly feels 60 Hz
        sde_sample_freq=16,
        policy_kwargs={"net_arch": [64, 64], "log_std_init": -0.5},
        seed=options.seed,
    )
    print(f"untrained: {speed(model):.2f} m/s")
    model.learn(options.steps, callback=Curve())
    reached = speed(model)
    print(f"after {options.steps} steps: {reached:.2f} m/s")
    return reached


if __name__ == "__main__":
    main()
