"""Grids of conditions: what they expand to, what conditions are called, what is refused."""

import dataclasses
import itertools
from pathlib import Path

import pytest

from experiments.analysis.registry import __all__ as analyses
from experiments.campaign.grid import (
    MACHINE_OPTIONS,
    QUICK,
    SCALE_OPTIONS,
    Condition,
    Grid,
    Scale,
    condition_name,
)
from experiments.campaign.options import CampaignOptions
from experiments.campaign.study import Study, read_study
from experiments.config import EvolveConfig
from experiments.report.figures import FIGURES
from experiments.studies.registry import GROUPS, STUDIES, find_studies


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


def names(study: str) -> list[str]:
    return [each.name for each in STUDIES[study].conditions(Scale())]


BODIES = [f"{s}-{a}" for s in ("biped-4x3", "worm-7x1") for a in ("low", "medium", "high")]
HIGH = [body for body in BODIES if body.endswith("high")]
NORMALIZED = ("hebbian", "hebbian-normalized", "hebbian-normalized-minmax")


def each_of(bodies: list[str], *suffixes: str) -> set[str]:
    return {f"{body}-{suffix}" for body in bodies for suffix in suffixes}


@pytest.mark.parametrize(
    ("study", "expected"),
    [
        ("effectiveness", each_of(BODIES, "hebbian", "mlp")),
        ("generalization", each_of(BODIES, "hebbian", "mlp")),
        ("damage", each_of(BODIES, "hebbian-damage-half", "mlp-damage-half")),
        ("true_learning", each_of(HIGH, "hebbian")),
        ("weight_dynamics", each_of(HIGH, *NORMALIZED)),
        ("normalization", each_of(HIGH, *NORMALIZED)),
        ("learning_rate", each_of(BODIES, "hebbian", "hebbian-eta-evolved")),
        (
            "rule_sharing",
            each_of(
                BODIES,
                "hebbian",
                "hebbian-single",
                "hebbian-grouped",
                "hebbian-postsynaptic",
                "hebbian-presynaptic",
            ),
        ),
        ("initialization", each_of(BODIES, "hebbian", "hebbian-init-uniform")),
        (
            "rule_terms",
            each_of(HIGH, "hebbian", *(f"hebbian-without-{term}" for term in "ABCD")),
        ),
        ("pruning", each_of(HIGH, "hebbian")),
        ("validation_matrix", each_of(BODIES, "hebbian", "mlp")),
    ],
)
def test_studies_have_the_conditions_of_the_paper(study: str, expected: set[str]) -> None:
    assert len(names(study)) == len(expected)
    assert set(names(study)) == expected


def test_studies_share_conditions() -> None:
    def union(group: str) -> dict[str, EvolveConfig]:
        found: dict[str, EvolveConfig] = {}
        for study in find_studies([group]):
            for each in study.conditions(Scale()):
                assert found.setdefault(each.name, each.config) == each.config
        return found

    # 12 plain, 12 damaged, 4 normalized, 6 with eta evolved, 24 sharing rules, 6 of random weights
    assert len(union("paper")) == 12 + 12 + 4 + 6 + 24 + 6
    # 40 static networks, 16 plastic ones at four control intervals, and 4 of the paper's code
    assert len(union("controls")) == 40 + 16 + 4
    # ... of which 8 are the plain ones; 8 without a term, 12 with genes of neurons, 8 attractors
    assert len(union("all")) == 64 + 60 - 8 + 8 + 12 + 8
    for config in union("all").values():
        assert (config.runs, config.generations, config.population) == (10, 500, 40)
        assert (config.duration, config.terrain, config.sigma) == (60.0, "hilly-3-30", 0.35)


def test_studies_are_what_their_scripts_are_called() -> None:
    assert [study.name for study in STUDIES.values()] == list(STUDIES)
    folder = Path(find_studies.__code__.co_filename).parent
    scripts = {path.stem for path in folder.glob("*.py")} - {"__init__", "bodies", "registry"}
    assert scripts == set(STUDIES)
    assert set(GROUPS["all"]) == scripts


def test_what_studies_make_of_their_runs_is_there() -> None:
    for study in STUDIES.values():
        assert set(study.analyses) <= set(analyses)
        assert set(study.figures) <= set(FIGURES)
    drawn = {figure for study in STUDIES.values() for figure in study.figures}
    assert drawn == set(FIGURES)


def test_studies_are_found_once_and_in_order() -> None:
    found = find_studies(["damage", "paper", "damage"])
    assert [study.name for study in found][:3] == ["damage", "effectiveness", "generalization"]
    assert len(found) == len(GROUPS["paper"])
    with pytest.raises(ValueError, match="study: expected some of effectiveness, .* got 'dmg'"):
        find_studies(["dmg"])


def test_a_condition_in_two_grids_of_a_study_is_one() -> None:
    low = Grid(axes={"sensors": ("low",)})
    study = Study("twice", "?", (low, Grid(axes={"sensors": ("low", "high")})))
    assert [each.name for each in study.conditions(QUICK)] == [
        "biped-4x3-low-hebbian",
        "biped-4x3-high-hebbian",
    ]


def test_quick_is_a_scale_of_its_own(tmp_path: Path) -> None:
    quick = CampaignOptions(out=tmp_path, scale=Scale(seed=3), quick=True).chosen_scale()
    assert quick == Scale(runs=2, generations=2, population=8, duration=2.0, seed=3)
    with pytest.raises(ValueError, match="quick: expected no --runs"):
        CampaignOptions(out=tmp_path, scale=Scale(runs=3), quick=True).chosen_scale()
    with pytest.raises(ValueError, match="generations: expected an integer >= 1, got 0"):
        CampaignOptions(out=tmp_path, scale=Scale(generations=0)).chosen_scale()
