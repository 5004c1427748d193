"""Environments made by Gymnasium: its own checkers, and what its users rely on."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from physics import Damage, Terrain
from physics.envs import VoxelEnv, stairs

SMALL: dict[str, Any] = {"shape": "worm-2x1", "sensors": "high", "episode": 0.5}
IDS = [f"hebbtorch/{task}-v0" for task in ("Locomotion", "Jumping", "Climbing")]


@pytest.mark.parametrize("name", IDS)
@pytest.mark.filterwarnings("error")
def test_gymnasiums_checker_passes(name: str) -> None:
    env = gymnasium.make(name, render_mode="rgb_array", **SMALL)
    check_env(env.unwrapped)


def test_making_one_needs_no_import() -> None:
    code = (
        "import gymnasium; env = gymnasium.make('physics.envs:hebbtorch/Locomotion-v0', "
        "shape='worm-7x1', terrain='hilly-3-30', sensors='high');"
        "print(env.observation_space.shape)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "(31,)"


@pytest.mark.parametrize(("noise", "low", "high"), [(0.0, 0.0, 1.0), (0.1, -np.inf, np.inf)])
def test_bounds_of_observations_are_true(noise: float, low: float, high: float) -> None:
    env = gymnasium.make(IDS[0], noise=noise, **SMALL)
    space = env.observation_space
    assert isinstance(space, gymnasium.spaces.Box)
    assert (space.low == low).all()
    assert (space.high == high).all()
    env.action_space.seed(0)
    seen = [env.reset(seed=0)[0]]
    for _ in range(60):
        seen.append(env.step(env.action_space.sample())[0])
    assert all(space.contains(each) for each in seen)
    outside = (np.array(seen) < 0) | (np.array(seen) > 1)
    assert outside.any() == (noise > 0)


def test_an_episode_ends_when_its_time_is_over() -> None:
    env = VoxelEnv(**SMALL)
    env.reset(seed=0)
    ends = [env.step(np.zeros(2, np.float32))[2:4] for _ in range(31)]
    assert ends == [(False, False)] * 30 + [(False, True)]  # the clock's 0.5 s are 31 steps


def test_a_seed_decides_terrain_noise_and_damage_of_all_episodes() -> None:
    def episodes(seed: int) -> list[list[Any]]:
        env = VoxelEnv(**SMALL, noise=0.1, damage=Damage(time=0.1))
        seen = []
        for k in range(3):
            first = env.reset(seed=seed if k == 0 else None)[0]
            steps = [env.step(np.ones(2, np.float32))[0] for _ in range(20)]
            seen.append([env.worlds.terrains()[0].name, np.array([first, *steps])])
        return seen

    one, again, other = episodes(3), episodes(3), episodes(4)
    for (name, readings), (same_name, same) in zip(one, again, strict=True):
        assert name == same_name
        assert np.array_equal(readings, same)
    assert len({name for name, _ in one + other}) == 6
    assert not np.array_equal(one[0][1], one[1][1])


def test_rewards_of_locomotion_are_the_velocity_of_the_centre() -> None:
    env = VoxelEnv(**SMALL)
    _, info = env.reset(seed=1)
    start, total = info["center"], 0.0
    for k in range(30):
        _, reward, _, _, info = env.step(np.full(2, np.sin(k / 3), np.float32))
        total += reward / 60
    assert total == pytest.approx(info["center"][0] - start[0], abs=1e-4)
    assert abs(total) > 1e-2


def test_jumping_rewards_what_is_in_the_air() -> None:
    env = VoxelEnv(task="jumping", **SMALL | {"episode": 5.0})
    env.reset(seed=0)
    falling = [env.step(np.zeros(2, np.float32))[1] for _ in range(150)]
    assert falling[0] == pytest.approx(1.0, abs=0.05)  # placed a metre above the ground
    assert falling[-1] == pytest.approx(0.0, abs=1e-3)  # and at rest on it


def test_climbing_rewards_what_goes_up_and_to_the_right() -> None:
    env = VoxelEnv(task="climbing", **SMALL)
    _, info = env.reset(seed=1)
    start, total = info["center"], 0.0
    for _ in range(20):
        _, reward, _, _, info = env.step(np.ones(2, np.float32))
        total += reward / 60
    assert total == pytest.approx((info["center"] - start).sum(), abs=1e-4)
    assert total < -0.3  # it falls


def test_stairs_rise_in_equal_steps_that_the_seed_decides() -> None:
    terrain = stairs(3)
    heights = terrain.height(np.array([34.0, 38.0, 43.0, 48.0]))
    rise = heights[1]
    assert 0.25 <= rise <= 0.75
    assert heights == pytest.approx(rise * np.arange(4))
    assert stairs(3).name == terrain.name != stairs(4).name


@pytest.mark.parametrize("terrain", ["flat", "hilly-3-30-2", Terrain.from_name("uphill-5")])
def test_a_given_terrain_is_the_same_in_every_episode(terrain: Any) -> None:
    env = VoxelEnv(terrain=terrain, **SMALL)
    names = set()
    for _ in range(2):
        env.reset()
        env.step(np.zeros(2, np.float32))
        names.add(env.worlds.terrains()[0].name)
    assert names == {terrain if isinstance(terrain, str) else terrain.name}


@pytest.mark.parametrize(
    "terrain", ["flat", "hilly-3-30", "steppy-1-10", "uphill-5", "downhill-5", "flatWithStart"]
)
def test_locomotion_takes_place_on_every_family_of_terrains(terrain: str) -> None:
    env = gymnasium.make(IDS[0], terrain=terrain, **SMALL)
    env.reset(seed=0)
    assert env.step(np.zeros(2, np.float32))[0].shape == (11,)


def test_pictures_have_one_size_and_show_the_robot() -> None:
    env = gymnasium.make(IDS[0], render_mode="rgb_array", **SMALL)
    env.reset(seed=0)
    pictures = []
    for _ in range(3):
        env.step(np.ones(2, np.float32))
        pictures.append(env.render())
    assert {picture.shape for picture in pictures} == {(288, 480, 3)}
    assert pictures[0].dtype == np.uint8
    assert not np.array_equal(pictures[0], pictures[2])
    assert VoxelEnv(**SMALL).render() is None


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"task": "flying"}, "task: expected one of locomotion, jumping, climbing or a Task"),
        ({"terrain": "hilly"}, "terrain: expected hilly-h-w-seed"),
        ({"terrain": 3}, "terrain: expected a Terrain, a name, a function"),
        ({"sensors": None}, "sensors: expected at least one reading"),
        ({"episode": 0.0}, "episode: expected a finite number >= 0.01"),
        ({"render_mode": "human"}, "render_mode: expected one of None, rgb_array, got 'human'"),
    ],
)
def test_bad_settings_are_told(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        VoxelEnv(**{**SMALL, **settings})


def test_a_step_needs_a_reset() -> None:
    with pytest.raises(ValueError, match="expected a reset before the first step"):
        VoxelEnv(**SMALL).step(np.zeros(2))
