"""Options: the paper's defaults, clear refusals before anything is written, JSON."""

import dataclasses
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from experiments.config import EvolveConfig
from experiments.config.options import options_of
from experiments.evolution.launch import evolve


def test_defaults_are_the_papers() -> None:
    config = EvolveConfig()
    config.validate()
    assert (config.population, config.generations, config.sigma) == (40, 500, 0.35)  # Sec. III-C
    assert (config.eta, config.init, config.normalize) == (0.01, "zeros", None)  # Sec. III-B
    assert (config.terrain, config.duration, config.noise) == ("hilly-3-30", 60.0, 0.01)  # Sec. IV


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("shape", "cube-3"),
        ("shape", "biped-4"),
        ("sensors", "lowest"),
        ("controller", "lstm"),
        ("gain", 0.0),
        ("gain", float("inf")),
        ("sharing", "none"),
        ("normalize", "l1"),
        ("eta", float("nan")),
        ("eta", "learned"),
        ("init", "ones"),
        ("terms", ""),
        ("terms", "DCB"),
        ("terms", 4),
        ("terrain", "hilly-3"),
        ("terrain", "mountain"),
        ("damage", "all"),
        ("generations", 0),
        ("population", 3),
        ("population", 4.5),
        ("sigma", 0.0),
        ("sigma", float("inf")),
        ("duration", 0.0),
        ("duration", float("nan")),
        ("noise", -0.1),
        ("runs", 0),
        ("seed", -1),
        ("seed", True),
        ("device", "tpu"),
        ("device", "cuda:99"),
        ("threads", 0),
        ("loop", "fast"),
    ],
)
def test_a_wrong_option_is_refused_and_nothing_written(
    name: str, value: object, tmp_path: Path
) -> None:
    config = replace(EvolveConfig(), **{name: value})
    with pytest.raises(ValueError, match=rf"^{name}: .*expected .*got") as refusal:
        evolve(config, tmp_path / "run")
    assert "\n" not in str(refusal.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("sharing", "single"),
        ("normalize", "l2"),
        ("eta", 0.1),
        ("init", "uniform"),
        ("terms", "BCD"),
        ("exchange_bc", True),
        ("constant_last_input", True),
    ],
)
def test_options_of_plasticity_are_refused_for_a_static_network(name: str, value: object) -> None:
    replace(EvolveConfig(), **{name: value}).validate()
    with pytest.raises(ValueError, match=rf"^{name}: .*mlp"):
        replace(EvolveConfig(), controller="mlp", **{name: value}).validate()


@pytest.mark.parametrize(("name", "value"), [("gain", 30.0), ("input_activation", "tanh")])
@pytest.mark.parametrize("controller", ["mlp", "rnn"])
def test_options_of_static_networks_are_refused_for_a_plastic_one(
    controller: str, name: str, value: object
) -> None:
    replace(EvolveConfig(), controller=controller, **{name: value}).validate()
    with pytest.raises(ValueError, match=rf"^{name}: .*hebbian"):
        replace(EvolveConfig(), **{name: value}).validate()


def test_json_keeps_every_option() -> None:
    config = EvolveConfig(
        shape="worm-7x1", eta="evolved", sigma=0.1 + 0.2, threads=3, runs=2, seed=2**62
    )
    assert EvolveConfig.from_json(config.to_json()) == config


def test_options_of_before_a_new_one_are_read_as_its_default() -> None:
    config = EvolveConfig(shape="worm-7x1")
    values = json.loads(config.to_json())
    del values["terms"]
    assert EvolveConfig.from_json(json.dumps(values)) == config


def test_earlier_and_textual_spellings_mean_the_same() -> None:
    written = EvolveConfig(normalize="none", init="zero")
    assert written == EvolveConfig()
    assert (written.normalize, written.init) == (None, "zeros")
    values = json.loads(EvolveConfig().to_json()) | {"normalize": "none", "init": "zero"}
    assert EvolveConfig.from_json(json.dumps(values)) == EvolveConfig()


def test_every_option_states_what_it_is() -> None:
    options = options_of(EvolveConfig)
    assert list(options) == [field.name for field in dataclasses.fields(EvolveConfig)]
    assert list(options_of(EvolveConfig, "axis")) == ["shape", "sensors", "controller", "damage"]
    assert set(options_of(EvolveConfig, "machine")) == {"device", "threads", "loop"}
    assert options["terms"].suffix("ACD") == "without-B"
    assert options["sharing"].label("grouped") == "sensors"
    assert options["sharing"].label("single") == "single"
    assert options["eta"].label(0.1) == "η = 0.1"


@pytest.mark.parametrize("text", ["", "{", "[]", '{"colour": 1}'])
def test_json_of_something_else_is_refused(text: str) -> None:
    with pytest.raises(ValueError):
        EvolveConfig.from_json(text)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"shape": []}, r"shape: expected text, got \[\]"),
        ({"sensors": {}}, "sensors: expected text, got {}"),
        ({"normalize": ["l2"]}, "normalize: expected a number or text, got"),
        ({"bias": 1}, "bias: expected true or false, got 1"),
        ({"runs": True}, "runs: expected a number or text, got True"),
        ({"eta": [0.01]}, "eta: expected a number or text"),
        ({"duration": 1e9}, "duration: expected at most 35791393 s, which are 2.31 steps"),
        ({"population": 10**12}, "population: expected at most [0-9]+, which fill the"),
        ({"runs": 10**12}, "population: expected at most"),
    ],
)
def test_what_files_and_scripts_may_hold_is_refused(options: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        EvolveConfig(**options).validate()


def test_text_that_is_no_configuration_is_refused() -> None:
    for text, message in (
        ("[" * 100_000, "config: expected a JSON object"),
        ("", "Expecting value"),
        ('{"format": 2}', "format: expected at most 1, got 2, which a newer version"),
        ('{"format": []}', "format: expected 1, got"),
    ):
        with pytest.raises(ValueError, match=message):
            EvolveConfig.from_json(text)
    assert EvolveConfig.from_json("{}") == EvolveConfig()


def test_numbers_of_numpy_become_plain_ones() -> None:
    config = EvolveConfig(population=np.int64(8), sigma=np.float32(0.5), seed=np.array(3))
    config.validate()
    assert EvolveConfig.from_json(config.to_json()) == config
    assert (type(config.population), type(config.sigma), config.seed) == (int, float, 3)
