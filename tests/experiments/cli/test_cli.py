"""The command line: exit codes, one clear line for a mistake, quick help."""

import csv
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

from experiments import cli

TINY = "--shape worm-2x1 --duration 0.5 --population 8 --generations 2 --threads 1"


def run(command: str, monkeypatch: pytest.MonkeyPatch) -> int:
    """The exit code of `hebbtorch <command>`."""
    monkeypatch.setattr(sys, "argv", ["hebbtorch", *command.split()])
    try:
        cli.main()
    except SystemExit as exit_:
        return int(exit_.code or 0)
    return 0


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("cli") / "run"
    with pytest.MonkeyPatch.context() as patch:
        assert run(f"evolve {TINY} --runs 2 --out {folder}", patch) == 0
    return folder


@pytest.mark.parametrize(
    "command",
    ["", "evolve ", "evaluate ", "freeze ", "render ", "validate ", "report ", "figures "],
)
def test_help(
    command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(f"{command}--help", monkeypatch) == 0
    shown = capsys.readouterr().out
    assert "usage: hebbtorch" in shown
    if command:
        assert "--seed" in shown
        assert "--out" in shown
        assert f"For example:\n    hebbtorch {command.strip()}" in shown


def test_alone_it_shows_its_help(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("", monkeypatch) == 0
    shown = capsys.readouterr().out
    assert "usage: hebbtorch" in shown
    assert "For example" not in shown  # one line for each command


def test_the_version_is_told(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("--version", monkeypatch) == 0
    assert capsys.readouterr().out == f"hebbtorch {version('hebbtorch')}\n"


@pytest.mark.slow
def test_quiet_tells_nothing_but_mistakes(
    finished: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run(f"evaluate {finished} -q --terrains 1 --out {tmp_path / 'a.csv'}", monkeypatch) == 0
    assert run(f"report {finished} --quiet --out {tmp_path / 'a.html'}", monkeypatch) == 0
    assert capsys.readouterr().out == ""
    assert run("evaluate nowhere --quiet", monkeypatch) == 2
    assert capsys.readouterr().err.startswith("hebbtorch: ")


def test_help_does_not_load_the_machinery() -> None:
    code = "import sys, experiments.cli; print({'torch', 'taichi'} & set(sys.modules))"
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert shown.stdout.strip() == "set()"


@pytest.mark.parametrize(
    "command",
    [
        "fly",
        "evolve --bogus",
        "evolve --population many",
        "evolve --controller lstm",
        "evolve --shape cube-3",
        "evolve --sigma -1",
        "evolve --resume nowhere",
        "evaluate",
        "evaluate nowhere",
        "evaluate nowhere --damage all",
        "freeze nowhere",
        "figures",
        "figures nowhere",
        "render nowhere",
    ],
)
def test_a_mistake_is_exit_code_2_and_leaves_nothing(
    command: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(command, monkeypatch) == 2
    assert capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_wrong_value_is_told_in_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("evolve --sigma -1", monkeypatch) == 2
    assert capsys.readouterr().err == (
        "hebbtorch: sigma: expected a finite number >= 0.0, got -1.0\n"
    )


def test_a_finished_run_is_not_overwritten(
    finished: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    before = (finished / "history.csv").read_bytes()
    assert run(f"evolve {TINY} --seed 9 --out {finished}", monkeypatch) == 2
    assert f"--resume {finished}" in capsys.readouterr().err
    assert (finished / "history.csv").read_bytes() == before


def test_resume_takes_no_other_option(finished: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert run(f"evolve --resume {finished} --sigma 0.1", monkeypatch) == 2
    assert run(f"evolve --resume {finished} --out elsewhere", monkeypatch) == 2


def test_without_out_a_free_folder_is_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for _ in range(2):
        assert run(f"evolve {TINY}", monkeypatch) == 0
    names = sorted(path.name for path in (tmp_path / "runs").iterdir())
    assert names == ["worm-2x1-low-hebbian", "worm-2x1-low-hebbian-2"]


def test_evaluate_writes_every_speed(
    finished: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "speeds.csv"
    assert run(f"evaluate {finished} --terrains 3 --damage half --out {out}", monkeypatch) == 0
    with out.open(newline="") as file:
        rows = list(csv.DictReader(file))
    terrains = ["hilly-3-30-0", "hilly-3-30-1", "hilly-3-30-2"]
    assert [(row["run"], row["terrain"], row["damage"]) for row in rows] == [
        (run, terrain, "half") for run in "01" for terrain in terrains
    ]
    speeds = sorted(float(row["speed"]) for row in rows[:3])
    assert f"champion of run 0: median {speeds[1]:.2f}" in capsys.readouterr().out


def test_render_writes_pictures(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "pictures"
    assert run(f"render {finished} --run 1 --out {out}", monkeypatch) == 0
    assert {path.suffix for path in out.iterdir()} == {".png", ".gif", ".mp4"}


@pytest.mark.parametrize("arguments", ["evolve --controller ultra", "evolve --bogus 3", "evaluate"])
def test_a_complaint_about_the_arguments_is_one_line(arguments, monkeypatch, capsys):
    assert run(arguments, monkeypatch) == 2
    complaint = capsys.readouterr().err
    assert complaint.startswith("hebbtorch: ")
    assert complaint.count("\n") == 1
    assert "--help" in complaint
