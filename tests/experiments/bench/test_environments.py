"""The throughput curve of environments."""

import csv
import json
import sys
from pathlib import Path

import pytest

from experiments.bench import environments, resets
from experiments.bench.environments import Rate
from experiments.bench.setting import Setting
from tests.experiments.commands import hebbtorch


def test_the_curve_is_measured_and_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("experiments.bench.benchmark._QUICK_ROUND", 0.01)
    out = tmp_path / "bench"
    assert hebbtorch(f"bench --quick --environments 5 --out {out}", monkeypatch) == 0
    found = json.loads((out / "environments.json").read_text())
    assert [rate["environments"] for rate in found["rates"]] == [1, 4]
    assert all(0 < r["least"] <= r["median"] <= r["greatest"] for r in found["rates"])
    with (out / "environments.csv").open() as file:
        assert [int(row["environments"]) for row in csv.DictReader(file)][:2] == [1, 4]
    assert (out / "environments.png").is_file()
    assert "4 environments" in capsys.readouterr().out


def test_evogym_is_measured_where_an_interpreter_has_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(environments, "_EVOGYM", "print('hello')\nprint([{rounds}, 4.0, 6.0])")
    assert environments.evogym(0.1, sys.executable) == Rate(1, 5.0, 4.0, 6.0)
    monkeypatch.setattr(environments, "_EVOGYM", "import evogym_that_is_nowhere")
    assert "evogym_that_is_nowhere" in str(environments.evogym(0.1))
    assert "not measured" in str(environments.evogym(0.1, str(tmp_path / "python")))


def test_resets_are_measured_beside_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(resets, "_STRETCH", 40)
    monkeypatch.setattr(resets, "_EPISODE", 0.5)  # [s], 30 steps
    monkeypatch.setattr(resets, "_WORLDS", 3)
    monkeypatch.setattr(resets, "_TRIES", 2)
    setting = Setting(cores=1, worlds=40, warm_up=1, repetitions=2)
    rows = [*resets.environments(setting), *resets.single_worlds(setting)]
    assert [row.unit for row in rows] == ["%", "%", "steps", "steps"]
    assert all(len(row.samples) == 2 and min(row.samples) > 0 for row in rows)
