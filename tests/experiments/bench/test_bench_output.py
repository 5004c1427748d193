"""What the bench writes, and its command."""

import json
from pathlib import Path

import pytest

from experiments.bench import (
    benchmark,
    display,
)
from experiments.bench.measurement import Measurement, Stage
from experiments.bench.setting import Setting
from tests.experiments.bench.benches import MACHINE, ROWS
from tests.experiments.commands import hebbtorch


def test_json_holds_every_figure(tmp_path: Path) -> None:
    file = tmp_path / "bench.json"
    display.write_json(file, MACHINE, 7, True, ROWS, [Stage("springs", 0.6)])
    content = json.loads(file.read_text())
    assert content["format"] == 1
    assert content["machine"] == {
        "cpu": "Abacus",
        "cores": 2,
        "python": "3.11.7",
        "torch": "2.13.0",
        "taichi": "1.7.4",
        "date": "2026-01-02T03:04:05+00:00",
        "command": "bench",
    }
    assert (content["seed"], content["quick"]) == (7, True)
    assert content["profile"] == [{"stage": "springs", "microseconds": 0.6}]
    speed, cost = content["rows"]
    assert speed == {
        "what": "speed",
        "value": 2.5,
        "unit": "steps/s",
        "more_is_better": True,
        "repetitions": 4,
        "median": 2.5,
        "best": 10.0,
        "quartiles": [1.75, 4.75],
        "baseline": 0.5,
        "ratio": 5.0,
        "target": {"bound": 2.0, "aim": 3.0},
        "verdict": "reached",
        "others": None,
    }
    assert (cost["verdict"], cost["baseline"], cost["others"]) == ("missed", None, 0.25)
    assert cost["target"] == {"bound": 3.0, "aim": None}


def test_markdown_holds_every_figure() -> None:
    text = display.markdown(MACHINE, ROWS, [Stage("springs", 0.6), Stage("noise", 0.2)])
    lines = text.splitlines()
    assert "Abacus, 2 cores" in lines[0]
    assert (
        "| speed | steps/s | 2.5 | 10 | 1.75 - 4.75 | 4 | 0.5 | x 5 | >= 2 / 3 | reached |  |"
        in (lines)
    )
    assert "| cost | us | 4 | 4 | 4 - 4 | 1 |  |  | <= 3 | MISSED | 0.2 |" in lines
    assert "| springs | 0.600 | 75.0 % |" in lines
    assert "| all | 0.800 |  |" in lines


@pytest.mark.parametrize("options", ["", "--quick --seed 4 --threads 2"])
def test_the_command_measures_shows_and_writes(
    options: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    settings: list[Setting] = []

    def measure(setting: Setting) -> list[Measurement]:
        settings.append(setting)
        return [ROWS[0]]

    def measure_otherwise(setting: Setting) -> list[Measurement]:
        return [ROWS[1]]

    monkeypatch.setattr(benchmark, "measurements", lambda: {"one": measure})
    monkeypatch.setattr(benchmark, "processes", lambda: {"two": measure_otherwise})
    file, folder = tmp_path / "new" / "speed.json", tmp_path / "out"
    assert hebbtorch(f"bench {options} --json {file} --out {folder}", monkeypatch) == 0
    (setting,) = set(settings)
    passes = 1 if options else 3
    assert len(settings) == setting.passes == passes
    assert setting.seed == (4 if options else 0)
    if options:
        assert setting.cores == 2
    shown = capsys.readouterr().out
    assert f"{passes + 1}/{passes + 1} two" in shown
    assert "reached" in shown
    content = json.loads(file.read_text())
    assert content == json.loads((folder / "bench.json").read_text())
    assert [(row["what"], row["repetitions"]) for row in content["rows"]] == [
        ("speed", 4 * passes),
        ("cost", 1),
    ]
    assert content["machine"]["command"].startswith("hebbtorch bench")
    assert "| speed |" in (folder / "bench.md").read_text()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("--threads 0", "threads: expected an integer >= 1, got 0"),
        ("--seed -1", "seed: expected an integer >= 0, got -1"),
        ("--json .", "json: expected a file to write, got the folder ."),
        ("--out file", "out: expected a folder, got the file file"),
        ("--speed 3", "speed"),
    ],
)
def test_a_mistake_is_exit_code_2_before_anything_is_measured(
    options: str,
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("file").touch()
    monkeypatch.setattr(benchmark, "measurements", dict)
    monkeypatch.setattr(benchmark, "processes", dict)
    assert hebbtorch(f"bench {options}", monkeypatch) == 2
    assert message in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
