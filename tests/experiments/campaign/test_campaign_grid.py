"""Grids of conditions: what they expand to, what conditions are called, what is refused."""

import dataclasses
import itertools
from pathlib import Path

import pytest

from experiments.campaign.grid import (
    MACHINE_OPTIONS,
    QUICK,
    SCALE_OPTIONS,
    Condition,
    Grid,
    Scale,
    condition_name,
)
from experiments.campaign.study import read_study
from experiments.config import EvolveConfig
from experiments.studies.registry import find_studies


def test_a_grid_is_every_combination_in_order() -> None:
    grid = Grid(
        base=EvolveConfig(shape="worm-7x1", generations=7),
        axes={"sensors": ("low", "high"), "eta": (0.01, "evolved")},
    )
    scale = Scale(runs=3, generations=5, population=8, duration=2.0, seed=4)
    expected = [
        EvolveConfig(
            shape="worm-7x1",
            sensors=sensors,
            eta=eta,
            runs=3,
            generations=5,
            population=8,
            duration=2.0,
            seed=4,
        )
        for sensors in ("low", "high")
        for eta in (0.01, "evolved")
    ]
    assert [each.config for each in grid.expand(scale)] == expected
    assert [each.name for each in grid.expand(scale)] == [
        "worm-7x1-low-hebbian",
        "worm-7x1-low-hebbian-eta-evolved",
        "worm-7x1-high-hebbian",
        "worm-7x1-high-hebbian-eta-evolved",
    ]


def test_a_grid_without_axes_is_one_condition() -> None:
    (only,) = Grid(EvolveConfig(controller="mlp")).expand(QUICK)
    assert only.name == "biped-4x3-low-mlp"


@pytest.mark.parametrize(
    ("options", "name"),
    [
        ({}, "biped-4x3-low-hebbian"),
        (
            {
                "shape": "worm-7x1",
                "sensors": "high",
                "sharing": "presynaptic",
                "normalize": "l2",
                "eta": "evolved",
                "init": "uniform",
                "damage": "half",
            },
            "worm-7x1-high-hebbian-presynaptic-normalized-eta-evolved-init-uniform-damage-half",
        ),
        ({"terms": "BCD"}, "biped-4x3-low-hebbian-without-A"),
        ({"terms": "AD"}, "biped-4x3-low-hebbian-without-BC"),
        (
            {"eta": 0.05, "noise": 0, "sigma": 1},
            "biped-4x3-low-hebbian-eta-0.05-sigma-1.0-noise-0.0",
        ),
        ({"terrain": "hilly-3-30-7"}, "biped-4x3-low-hebbian-terrain-hilly-3-30-7"),
    ],
)
def test_names_say_what_differs_from_the_paper(options: dict, name: str) -> None:
    assert condition_name(EvolveConfig(**options)) == name


def test_neither_scale_nor_machine_is_in_a_name() -> None:
    other = {"threads": 3, "loop": "torch"} | dataclasses.asdict(Scale(seed=5, runs=3))
    assert condition_name(EvolveConfig(**other)) == condition_name(EvolveConfig())


def test_every_other_option_is_in_a_name() -> None:
    others = {
        "shape": "worm-7x1",
        "sensors": "high",
        "controller": "mlp",
        "sharing": "single",
        "normalize": "l2",
        "eta": 0.1,
        "init": "uniform",
        "rule": "oja",
        "average": 10,
        "every": 4,
        "decay": 0.1,
        "clip": 3.0,
        "fixed": True,
        "terms": "ABC",
        "terrain": "flat",
        "damage": "half",
        "optimizer": "cma",
        "sigma": 0.1,
        "noise": 0.1,
        "noise_area": 0.2,
        "noise_touch": 0.3,
        "noise_velocity": 0.4,
        "noise_lidar": 0.0,
        "control_interval": 12,
        "control_delay": 1,
        "actuation_cutoff": 5.0,
        "gravity": 1.6,
        "friction": 0.5,
        "spring_frequency": 6.0,
        "spring_damping": 0.5,
        "damage_mode": "frozen",
        "damage_probability": 0.2,
        "damage_time": 10.0,
        "damage_until": 50.0,
        "damage_voxels": "0,3",
        "exchange_bc": True,
        "constant_last_input": True,
        "gain": 30.0,
        "bias": True,
        "input_activation": "tanh",
    }
    options = {field.name for field in dataclasses.fields(EvolveConfig)}
    assert options == {*others, *SCALE_OPTIONS, *MACHINE_OPTIONS}
    chosen = [subset for size in range(3) for subset in itertools.combinations(others, size)]
    names = {
        condition_name(EvolveConfig(**{name: others[name] for name in subset})) for subset in chosen
    }
    assert len(names) == len(chosen)


@pytest.mark.parametrize(
    ("base", "axes", "message"),
    [
        ({}, {"sensor": ["low"]}, "axes: expected some of shape, sensors, .* got 'sensor'"),
        ({}, {"runs": [1, 2]}, "axes: expected no runs, .* as --runs"),
        ({}, {"threads": [1]}, "axes: .* got 'threads'"),
        ({}, {"sensors": []}, "sensors: expected a list of values"),
        ({}, {"sensors": "low"}, "sensors: expected a list of values, got 'low'"),
        ({}, {"eta": [0.1, 0.1]}, "eta: expected every value once"),
        ({}, {"sensors": ["low", "best"]}, "grid at sensors best: sensors: expected one of"),
        ({}, {"noise": [True]}, "noise: expected a number, got True"),
        ({}, {"shape": [3]}, "shape: expected text, got 3"),
        ({}, {"sigma": [0.1, -1]}, "grid at sigma -1: sigma: expected"),
        (
            {},
            {"controller": ["hebbian", "mlp"], "normalize": ["l2"]},
            "grid at controller mlp, normalize l2: normalize: expected no such option",
        ),
        ({"terrain": "moon"}, {}, "grid at its base: terrain"),
    ],
)
def test_wrong_grids_are_refused(base: dict, axes: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Grid(EvolveConfig(**base), axes).expand(QUICK)


def test_a_grid_of_ones_own(tmp_path: Path) -> None:
    file = tmp_path / "terrains.toml"
    file.write_text(
        '[base]\nshape = "worm-3x1"\nsensors = "medium"\nnoise = 0\n'
        '[axes]\nterrain = ["flat", "hilly-3-30"]\ncontroller = ["hebbian", "mlp"]\n'
    )
    study = read_study(file)
    assert study.name == "terrains"
    config = EvolveConfig(
        shape="worm-3x1", sensors="medium", noise=0, **dataclasses.asdict(QUICK), terrain="flat"
    )
    conditions = study.conditions(QUICK)
    assert conditions[0] == Condition("worm-3x1-medium-hebbian-terrain-flat-noise-0.0", config)
    assert len(conditions) == 4


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[base", "grid: cannot read"),
        ("[base]\n[axis]\n", "grid: expected tables .base. and .axes., got axis"),
        ("base = 3\n", "grid: expected .base. to be a table, got 3"),
        ('[base]\nform = "x"\n', "base: expected some of .* got 'form'"),
        ("[base]\nseed = 3\n", "base: expected no seed"),
        ("[base]\nshape = 3\n", "shape: expected text, got 3"),
        ("[base]\neta = [1]\n", "eta: expected a number, got"),
        ("[base]\neta = 1\n[axes]\neta = [2]\n", "grid: expected eta in .base. or in .axes., got"),
    ],
)
def test_wrong_files_are_refused(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "grid.toml"
    file.write_text(text)
    with pytest.raises(ValueError, match=message):
        read_study(file).conditions(QUICK)


def test_a_file_that_is_missing_or_called_like_a_study_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="grid: cannot read"):
        find_studies((), tmp_path / "none.toml")
    file = tmp_path / "damage.toml"
    file.write_text("")
    with pytest.raises(ValueError, match="grid: expected a file with a name of its own"):
        find_studies((), file)
