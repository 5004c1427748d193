"""Many environments at once: Gymnasium's conventions, with tensors that are the caller's own."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest
import torch
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from torch import Tensor

from physics import Damage
from physics.envs import Task, VoxelEnv, VoxelVectorEnv
from tests.physics.worlds import gaits

N = 5
SMALL: dict[str, Any] = {"shape": "worm-2x1", "sensors": "high", "episode": 0.5}
HARD: dict[str, Any] = {**SMALL, "noise": 0.1, "damage": Damage(time=0.2, mode="random")}
ACTIONS = gaits(80, N, 2).float()


def make(**settings: Any) -> VoxelVectorEnv:
    return VoxelVectorEnv(num_envs=N, **{**SMALL, **settings})


def test_it_is_gymnasiums_vector_of_single_environments() -> None:
    """Over three episodes, with noise, damage and terrains that change with each."""
    many = gymnasium.make_vec("physics.envs:hebbtorch/Locomotion-v0", num_envs=N, **HARD)
    single = SyncVectorEnv([lambda: VoxelEnv(**HARD)] * N, autoreset_mode=AutoresetMode.SAME_STEP)
    assert many.observation_space == single.observation_space
    assert many.action_space == single.action_space
    assert many.metadata["autoreset_mode"] == AutoresetMode.SAME_STEP
    first, infos = many.reset(seed=7)
    expected, expected_infos = single.reset(seed=7)
    assert np.array_equal(first, expected)
    for action in ACTIONS.numpy():
        ours, theirs = many.step(action), single.step(action)
        for one, other in zip(ours[:4], theirs[:4], strict=True):
            assert isinstance(one, np.ndarray)
            assert np.array_equal(one, other)
        infos, expected_infos = ours[4], theirs[4]
        assert infos.keys() == expected_infos.keys() - {"_center"}
        assert np.array_equal(infos["center"], np.stack(expected_infos["center"]))
        if "final_obs" in infos:
            assert np.array_equal(infos["_final_obs"], expected_infos["_final_obs"])
            assert np.array_equal(infos["final_obs"], np.stack(expected_infos["final_obs"]))
            last = expected_infos["final_info"]["center"]
            assert np.array_equal(infos["final_info"]["center"], np.stack(last))
    assert ours[3].sum() == 0


def test_tensors_are_the_callers_own() -> None:
    """What is kept does not change, and what is written changes nothing."""
    env, other = make(), make()
    kept = [env.reset(seed=0)[0]]
    other.reset(seed=0)
    for action in ACTIONS[:40]:
        *outputs, infos = env.step(action)
        final = [infos[key] for key in ("final_obs", "_final_obs") if key in infos]
        for mine in (*outputs, infos["center"], *final):
            assert isinstance(mine, Tensor)
        kept.append(outputs[0])
        for one, two in zip(outputs, other.step(action)[:4], strict=True):
            assert torch.equal(one, two)
        copies = [each.clone() for each in kept]
        for mine in (*outputs[1:], infos["center"], *final):
            mine.zero_()
        assert all(torch.equal(*pair) for pair in zip(kept, copies, strict=True))


def test_same_step_returns_the_first_observation_of_the_next_episode() -> None:
    env = make()
    env.reset(seed=0)
    for action in ACTIONS[: env.episode_steps]:
        observations, _, terminated, truncated, infos = env.step(action)
    assert truncated.all()
    assert not terminated.any()
    assert infos["_final_obs"].all()
    assert torch.equal(observations, env.sim.readings())
    assert not torch.equal(observations, infos["final_obs"])
    assert (env.sim.times == 0).all()
    assert torch.equal(infos["center"], env.sim.center_of_mass())


@pytest.mark.parametrize("kind", [torch.as_tensor, np.asarray])
def test_a_mask_resets_some_worlds(kind: Any) -> None:
    env = make(autoreset="disabled")
    assert env.metadata["autoreset_mode"] == AutoresetMode.DISABLED
    env.reset(seed=0)
    for action in ACTIONS[:35]:
        before, *_, truncated, infos = env.step(action)
    assert truncated.all()
    assert "final_obs" not in infos
    mask = [True, False, True, False, False]
    observations, _ = env.reset(options={"reset_mask": kind(mask)})
    chosen = torch.tensor(mask)
    assert torch.equal(observations[~chosen], before[~chosen])
    assert (env.sim.times == 0).tolist() == mask
    assert env.step(ACTIONS[0])[3].tolist() == [not each for each in mask]


def test_worlds_do_not_depend_on_each_others_episodes() -> None:
    """Every world in its own phase: alone it goes through the same episodes, bit for bit."""
    ends = {3: [0], 8: [1, 2], 20: [0, 4], 33: [0, 1, 2, 3, 4], 50: [2]}

    def run(worlds: list[int]) -> Tensor:
        settings = {**HARD, "autoreset": "disabled"}
        env = VoxelVectorEnv(num_envs=len(worlds), **settings)
        seen = [env.reset(seed=[10 + world for world in worlds])[0]]
        for step in range(60):
            if step in ends:
                mask = torch.tensor([world in ends[step] for world in worlds])
                if mask.any():
                    seen.append(env.reset(options={"reset_mask": mask})[0])
            seen.append(env.step(ACTIONS[step, worlds])[0])
        return seen[-1]

    together = run(list(range(N)))
    for world in range(N):
        assert torch.equal(run([world])[0], together[world])


def test_a_world_that_fails_is_over_and_begins_anew() -> None:
    env = make(autoreset="same_step")
    env.reset(seed=0)
    env.step(ACTIONS[0])
    poses = env.sim.mass_poses()
    poses[2] = torch.nan
    env.sim.set_poses(poses, env.sim.mass_velocities())
    observations, reward, terminated, truncated, infos = env.step(ACTIONS[1])
    assert terminated.tolist() == [False, False, True, False, False]
    assert not truncated.any()
    assert torch.isfinite(reward).all()
    assert (infos["final_obs"][2] == 0).all()
    assert env.observation_space.contains(observations.numpy())
    assert not env.sim.failed().any()


def test_phases_can_be_spread() -> None:
    env = make(episode=1.0)
    env.reset(seed=0)
    env.spread_phases()
    ends = torch.stack([env.step(action)[3] for action in ACTIONS[: env.episode_steps]])
    assert (ends.sum(0) == 1).all()
    assert ends.sum(1).max() == 1
    env.spread_phases(2)
    ends = torch.stack([env.step(action)[3] for action in ACTIONS[: env.episode_steps]])
    assert sorted(ends.sum(1).tolist())[-2:] == [2, 3]  # of five worlds in two groups
    with pytest.raises(ValueError, match="groups: expected at most 5, got 6"):
        env.spread_phases(6)


class Upright(Task):
    """A task of a user's own: the height of the centre."""

    terrain = "flat"

    def look(self, sim: Any) -> Tensor:
        return sim.center_of_mass()[:, 1]

    def reward(self, before: Tensor, after: Tensor, seconds: float) -> Tensor:
        return after


def test_a_task_may_be_of_ones_own() -> None:
    env = make(task=Upright())
    env.reset(seed=0)
    _, reward, *_, infos = env.step(ACTIONS[0])
    assert torch.equal(reward, infos["center"][:, 1])


def test_settings_of_the_simulator_pass_through() -> None:
    env = make(control_interval=6, friction=0.5, dtype=torch.float64)
    assert env.episode_steps == 6
    assert env.metadata["render_fps"] == 10
    assert env.single_observation_space.dtype == np.float64
    env.reset(seed=0)
    assert env.step(ACTIONS[0])[0].dtype == torch.float64
    assert env.sim.time == pytest.approx(0.1)


def test_noise_of_some_sensors_leaves_readings_unbounded() -> None:
    env = make(noise={"area": 0.1})
    assert np.isinf(env.single_observation_space.high).all()
    assert not torch.equal(env.reset(seed=0)[0], make().reset(seed=0)[0])
    assert (make(noise={"area": 0.0}).single_observation_space.high == 1).all()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"seed": [1, 2]}, "seed: expected one or 5 of them, got 2"),
        ({"seed": -10}, "seed: expected an integer >= 0, got -10"),
        ({"seed": [1, 2, 1.5, 3, 4]}, "seed: expected an integer >= 0, got 1.5"),
        ({"seed": "x"}, "seed: expected an integer >= 0, got 'x'"),
        ({"options": {"mask": None}}, "options: expected no other than 'reset_mask', got 'mask'"),
        ({"options": {"reset_mask": [True] * N}}, "reset_mask: expected a tensor .* got list"),
        ({"options": {"reset_mask": torch.ones(3) > 0}}, "reset_mask: .*worlds=5.* got shape"),
    ],
)
def test_bad_resets_are_told(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make().reset(**options)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"num_envs": 0}, "num_envs: expected an integer >= 1, got 0"),
        ({"autoreset": "next_step"}, "autoreset: expected one of same_step, disabled"),
        ({"arrays": "jax"}, "arrays: expected one of torch, numpy, got 'jax'"),
    ],
)
def test_bad_settings_are_told(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        VoxelVectorEnv(**{**SMALL, **settings})


def test_worlds_may_have_different_robots() -> None:
    """All have the spaces of the largest; each robot moves as it does alone."""
    shapes = ["worm-2x1", "worm-3x1", "worm-2x1", "worm-3x1", "worm-2x1"]
    env = make(shape=shapes, task="jumping")
    first, _ = env.reset(seed=7)
    assert env.single_action_space.shape == (3,)
    actions = torch.rand(32, N, 3, generator=torch.Generator().manual_seed(0)) * 2 - 1
    outputs = [env.step(action) for action in actions]  # into the second episode
    assert all(torch.isfinite(each).all() for output in outputs for each in output[:2])
    for world in (0, 1):
        alone = VoxelVectorEnv(num_envs=1, **{**SMALL, "shape": shapes[world], "task": "jumping"})
        own = alone.reset(seed=[7 + world])[0]
        r, v = alone.sim.n_readings, alone.sim.n_voxels
        assert torch.equal(first[[world], :r], own)
        assert (first[world, r:] == 0).all()
        for action, output in zip(actions, outputs, strict=True):
            observation, reward, _, truncated, _ = alone.step(action[[world], :v])
            assert torch.equal(output[0][[world], :r], observation)
            assert torch.equal(output[1][[world]], reward)
            assert torch.equal(output[3][[world]], truncated)
