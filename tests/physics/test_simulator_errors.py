"""What is wrong with a simulator's arguments is told by name, and nothing changes."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from physics import Apparatus, Damage, Engine, Sensor, Simulator
from tests.physics.worlds import FLAT, small

ONE = Apparatus(((Sensor("area"),),))

BAD_SETTINGS = [
    ({"shape": "bipod-4x3"}, "shape: expected one of .* got 'bipod-4x3'"),
    ({"shape": [[1, 0, 1]]}, "shape: expected voxels joined"),
    ({"shape": None}, "shape: expected a 2-D 0/1 array"),
    ({"terrain": "flat"}, "terrain: expected physics.Terrain, got 'flat'; build one with"),
    ({"terrain": 5.0}, "terrain: expected physics.Terrain, got 5.0"),
    ({"terrain": [FLAT] * 3}, "terrain: expected one Terrain, a list of 2 or None, got 3"),
    ({"terrain": [FLAT, None]}, "terrain: expected physics.Terrain, got None"),
    ({"n_worlds": 0}, "n_worlds: expected an integer >= 1, got 0"),
    ({"n_worlds": 2.0}, "n_worlds: expected an integer >= 1, got 2.0"),
    ({"sensors": "most"}, "sensors: expected one of low, medium, high, got 'most'"),
    ({"sensors": ONE}, "sensors: expected one tuple for each of the 2 voxels"),
    ({"noise": -0.1}, "noise: expected a finite number >= 0, got -0.1"),
    ({"noise": "much"}, "noise: expected a finite number >= 0, got 'much'"),
    ({"gravity": math.nan}, "gravity: expected a finite number, got nan"),
    ({"gravity": None}, "gravity: expected a finite number, got None"),
    ({"dtype": torch.float16}, "dtype: expected torch.float32 or torch.float64, got torch.float16"),
    ({"dtype": "float32"}, "dtype: expected torch.float32 or torch.float64, got float32"),
    ({"device": "gpu"}, 'device: expected "cpu" or "cuda", got \'gpu\''),
    ({"device": "mps"}, 'device: expected "cpu" or "cuda", got \'mps\''),
    ({"device": None}, 'device: expected "cpu" or "cuda", got None'),
    ({"seed": -1}, "seed: expected integers >= 0, got -1"),
    ({"seed": 1.5}, "seed: expected integers >= 0, got 1.5"),
    ({"seed": "one"}, "seed: expected integers >= 0, got 'o'"),
    ({"seed": None}, "seed: expected integers >= 0, got None"),
    ({"seed": [1, 2, 3]}, "seed: expected one integer or 2 of them, got 3"),
    ({"seed": [1, -2]}, "seed: expected integers >= 0, got -2"),
    ({"threads": 0}, "threads: expected an integer >= 1, got 0"),
    ({"threads": 1.5}, "threads: expected an integer >= 1, got 1.5"),
    ({"lanes": 0}, "lanes: expected an integer >= 1, got 0"),
    ({"lanes": 3}, "lanes: expected a power of two up to 32, got 3"),
    ({"lanes": 256}, "lanes: expected a power of two up to 32, got 256"),
    ({"n_worlds": 2**40}, r"n_worlds: expected at most \d+, which fill the"),
    ({"n_worlds": True}, "n_worlds: expected an integer >= 1, got True"),
    (
        {"lifetime": 1e9},
        "lifetime: expected at most 35791393 s, which are 2.31 steps, got 1000000000.0",
    ),
    ({"lanes": "8"}, "lanes: expected an integer >= 1, got '8'"),
    ({"lifetime": -1.0}, "lifetime: expected a finite number >= 0, got -1.0"),
    ({"lifetime": [1.0]}, "lifetime: expected one or 2 numbers"),
    ({"lifetime": math.inf}, "lifetime: expected a finite number >= 0, got inf"),
    ({"damage": "half"}, "damage: expected physics.Damage or None, got 'half'"),
    ({"engine": {"friction": 1.0}}, "engine: expected physics.Engine or None"),
]


@pytest.mark.parametrize(("setting", "message"), BAD_SETTINGS)
def test_bad_settings_are_told(setting, message):
    good = {"shape": "worm-2x1", "terrain": FLAT, "n_worlds": 2}
    with pytest.raises(ValueError, match=message):
        Simulator(**{**good, **setting})


BAD_CALLS = [
    ("step", [torch.zeros(2, 3)], r"actuation: .*worlds=2, voxels=2.* got shape \(2, 3\)"),
    ("step", [torch.zeros(2)], r"actuation: .*worlds=2, voxels=2.* got shape \(2,\)"),
    ("step", [[[0.0, 0.0]] * 2], "actuation: expected a tensor .* got list"),
    ("step", [torch.tensor([[0.0, math.nan]] * 2)], "actuation: expected finite numbers"),
    ("step", [torch.tensor([[math.inf, 0.0]] * 2)], "actuation: expected finite numbers"),
    ("run", [torch.tensor([[[math.nan, 0.0]] * 2])], "actuations: expected finite numbers"),
    ("run", [torch.zeros(2, 2)], r"actuations: .*steps, worlds=2, voxels=2.* got shape \(2, 2\)"),
    ("run", [torch.zeros(5, 2, 1)], r"actuations: .* got shape \(5, 2, 1\)"),
    ("run", [np.zeros((5, 2, 2))], "actuations: expected a tensor .* got ndarray"),
    ("reset", [torch.zeros(3, dtype=torch.bool)], r"worlds: .*worlds=2.* got shape \(3,\)"),
    ("reset", [torch.zeros(2)], "worlds: expected a bool mask, got torch.float32"),
    ("reset", [[True, False]], "worlds: expected a tensor .* got list"),
    ("set_poses", [torch.zeros(2, 2, 4, 2)], r"poses: .* got shape \(2, 2, 4, 2\)"),
    ("set_poses", [torch.zeros(2, 2, 4, 3), torch.zeros(3)], r"velocities: .* got shape \(3,\)"),
    ("replay", [torch.zeros(2, 2, 4, 3), torch.zeros(2, 2, 4, 3)], "poses: .*steps, worlds=2"),
    ("replay", [torch.zeros(3, 2, 2, 4, 3), torch.zeros(2, 2, 2, 4, 3)], "velocities: .*steps=3"),
]


@pytest.mark.parametrize(("call", "arguments", "message"), BAD_CALLS)
def test_bad_arguments_are_told_and_change_nothing(call, arguments, message):
    sim = small()
    before, time = sim.mass_poses(), sim.time
    with pytest.raises(ValueError, match=message):
        getattr(sim, call)(*arguments)
    assert torch.equal(sim.mass_poses(), before)
    assert sim.time == time


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"friction": -0.1}, "friction: expected a finite number >= 0, got -0.1"),
        ({"damping": math.nan}, "damping: expected a finite number >= 0, got nan"),
        ({"velocity_iterations": 0}, "velocity_iterations: expected an integer >= 1, got 0"),
        ({"position_iterations": 1.5}, "position_iterations: expected an integer >= 1, got 1.5"),
    ],
)
def test_bad_settings_of_the_engine_are_told(setting, message):
    with pytest.raises(ValueError, match=message):
        Engine(**setting)


def test_integers_of_other_kinds_will_do():
    seeds = (np.int64(3), 3)
    sims = [small(seed=seed, noise=0.1, lifetime=np.float32(1.0)) for seed in seeds]
    assert torch.equal(*[sim.reset() for sim in sims])
    assert small(damage=Damage()).step(torch.zeros(2, 2, dtype=torch.int64)).shape == (2, 2)
