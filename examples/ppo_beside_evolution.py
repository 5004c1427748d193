"""PPO beside the paper's evolution strategy, on the same budget of robot-steps, in one figure.

A worm on level ground, episodes of 15 s, medium sensors without noise: PPO of stable-baselines3
with the settings of `ppo_walks.py`, and Algorithm 1 of the paper with plastic and with static
networks. Every algorithm may spend the same number of robot-steps (worlds times control steps of
1/60 s) on learning. What it has by then is measured apart, in one episode without exploration: the
policy's mean for PPO, the fittest genome so far for evolution. Needs the extra ``rl``; three seeds
of 650,000 steps take about five minutes on one core, nearly all of it PPO's.

    python examples/ppo_beside_evolution.py --out comparison
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback

import hebbtorch
from experiments.config import EvolveConfig
from experiments.io.style import SPEED, looks, sheet
from experiments.rollout import fitness
from physics import steps_in
from physics.envs.sb3 import VoxelVecEnv

SHAPE, SENSORS, EPISODE = "worm-7x1", "medium", 15.0
POPULATION = 40
METHODS = ("PPO", "Algorithm 1, plastic", "Algorithm 1, static")

Row = tuple[str, int, int, float]  # method, seed, robot-steps, speed [m/s]


def ppo_curve(steps: int, seed: int, every: int) -> list[Row]:
    """Speed of the policy as it learns.

    Args:
        steps: robot-steps of training.
        seed: of everything random.
        every: robot-steps between two measurements.
    """
    model = PPO(
        "MlpPolicy",
        VoxelVecEnv(shape=SHAPE, terrain="flat", num_envs=64, sensors=SENSORS, episode=EPISODE),
        n_steps=128,
        batch_size=1024,
        n_epochs=5,
        learning_rate=1e-3,
        use_sde=True,
        sde_sample_freq=16,
        policy_kwargs={"net_arch": [64, 64], "log_std_init": -0.5},
        seed=seed,
    )
    judge = VoxelVecEnv(shape=SHAPE, terrain="flat", num_envs=1, sensors=SENSORS, episode=EPISODE)
    rows: list[Row] = [(METHODS[0], seed, 0, _speed(model, judge))]

    class Measure(BaseCallback):
        """Measures the policy every so many steps."""

        def _on_rollout_start(self) -> None:
            if self.num_timesteps >= rows[-1][2] + every:
                self._measure()

        def _on_training_end(self) -> None:
            self._measure()

        def _measure(self) -> None:
            rows.append((METHODS[0], seed, self.num_timesteps, _speed(model, judge)))
            print(f"PPO, seed {seed}: {rows[-1][2]:>8} steps {rows[-1][3]:6.2f} m/s", flush=True)

        def _on_step(self) -> bool:
            return True

    model.learn(steps, callback=Measure())
    return rows


def _speed(model: PPO, env: VoxelVecEnv) -> float:
    """Mean velocity over an episode without exploration [m/s]."""
    observations, total = env.reset(), 0.0
    for _ in range(env.worlds.episode_steps):
        actions, _ = model.predict(observations, deterministic=True)
        observations, rewards, _, _ = env.step(actions)
        total += float(rewards.mean())
    return total / env.worlds.episode_steps


def evolution_curve(steps: int, seed: int, controller: str, method: str) -> list[Row]:
    """Speed of the fittest genome so far, generation by generation.

    Args:
        steps: robot-steps of all evaluations.
        seed: of everything random.
        controller: "hebbian" or "mlp".
        method: what to call it.
    """
    config = EvolveConfig(
        shape=SHAPE, sensors=SENSORS, terrain="flat", duration=EPISODE, noise=0.0,
        controller=controller, normalize=None, seed=seed, threads=1,
    )  # fmt: skip
    evaluate = fitness(config)
    strategy = hebbtorch.EvolutionStrategy(evaluate.n_genes, population=POPULATION, seed=seed)
    per_generation = POPULATION * steps_in(EPISODE)
    rows: list[Row] = []
    for generation in range(1, steps // per_generation + 1):
        strategy.tell(evaluate(strategy.ask(), generation))
        rows.append((method, seed, generation * per_generation, float(strategy.best_fitness)))
    print(f"{method}, seed {seed}: {rows[-1][2]:>8} steps {rows[-1][3]:6.2f} m/s", flush=True)
    return rows


def draw(rows: Sequence[Row], out: Path) -> list[Path]:
    """The figure, curves.png and .pdf: median and range of the seeds against robot-steps.

    Args:
        rows: of all methods and seeds.
        out: an existing folder.
    """
    look = looks(METHODS)
    with sheet(out, "curves", (3.6, 2.4)) as page:
        axes = page.panel(0)
        for method in METHODS:
            steps, table = curves([row for row in rows if row[0] == method])
            own = look[method]
            axes.fill_between(steps, table.min(0), table.max(0), color=own.color, alpha=0.2, lw=0)
            axes.plot(steps, np.median(table, 0), color=own.color, linestyle=own.line, label=method)
        axes.set(xlabel="robot-steps of learning", ylabel=SPEED)
        axes.legend()
        page.note(
            f"{SHAPE} on level ground, episodes of {EPISODE:g} s, without exploration; lines are "
            f"medians, bands the range of {len({row[1] for row in rows})} seeds"
        )
    return page.files


def curves(rows: Sequence[Row]) -> tuple[np.ndarray, np.ndarray]:
    """Steps (K,) and the speeds of S seeds at them, (S, K)."""
    seeds = sorted({row[1] for row in rows})
    steps = sorted({row[2] for row in rows if row[1] == seeds[0]})
    speeds = {(row[1], row[2]): row[3] for row in rows}
    return np.array(steps), np.array([[speeds[seed, step] for step in steps] for seed in seeds])


def main(arguments: Sequence[str] | None = None) -> dict[str, float]:
    """Trains all, writes table and figure, and returns the median speed of each method [m/s]."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=650_000, help="robot-steps of learning")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--every", type=int, default=50_000, help="steps between measurements")
    parser.add_argument("--out", type=Path, default=Path("ppo-beside-evolution"))
    options = parser.parse_args(arguments)
    torch.set_num_threads(1)
    options.out.mkdir(parents=True, exist_ok=True)
    rows: list[Row] = []
    for seed in range(options.seeds):
        rows += evolution_curve(options.steps, seed, "hebbian", METHODS[1])
        rows += evolution_curve(options.steps, seed, "mlp", METHODS[2])
        rows += ppo_curve(options.steps, seed, options.every)
    with (options.out / "curves.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["method", "seed", "robot_steps", "speed"])
        writer.writerows((*row[:3], f"{row[3]:.4f}") for row in rows)
    for path in draw(rows, options.out):
        print(f"wrote {path}")
    return {
        method: float(np.median(curves([row for row in rows if row[0] == method])[1][:, -1]))
        for method in METHODS
    }


if __name__ == "__main__":
    print(main())
