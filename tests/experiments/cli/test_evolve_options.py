"""The options of `hebbtorch evolve` under headings are those of `EvolveConfig`."""

from __future__ import annotations

import dataclasses
import re

import pytest

from experiments.cli.evolve_options import GroupedOptions, flat
from experiments.config import EvolveConfig
from tests.experiments.commands import hebbtorch


def test_grouped_defaults_are_the_defaults() -> None:
    assert flat(GroupedOptions()) == EvolveConfig()


def test_an_option_of_each_group_reaches_the_evolution() -> None:
    default = GroupedOptions()
    other = {
        "robot": {"shape": "worm-2x1"},
        "controller": {"bias": True},
        "plasticity": {"eta": 0.5},
        "world": {"gravity": 1.6},
        "evolution": {"seed": 7},
        "computation": {"threads": 1},
    }
    changed = {
        group: dataclasses.replace(getattr(default, group), **values)
        for group, values in other.items()
    }
    flattened = {name: value for values in other.values() for name, value in values.items()}
    assert flat(dataclasses.replace(default, **changed)) == EvolveConfig(**flattened)


def test_help_describes_every_option_once(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert hebbtorch("evolve --help", monkeypatch) == 0
    text = capsys.readouterr().out
    named = re.findall(r"^. (--[a-z][a-z-]*)", text, flags=re.MULTILINE)
    options = [f"--{field.name.replace('_', '-')}" for field in dataclasses.fields(EvolveConfig)]
    assert sorted(named) == sorted([*options, "--out", "--resume"])
    for words in ("Robot: biped-WxH", "Learning rate", "plasticity options"):
        assert words in text
