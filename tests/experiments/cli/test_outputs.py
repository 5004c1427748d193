"""What cannot be written is told before anything is computed, by every command that writes."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

import physics
from experiments import cli
from experiments.config import EvolveConfig
from experiments.io.outputs import make_room, require_folder
from experiments.report.bundle import pack
from tests.experiments.finished_runs import write_evaluation, write_run

NOWHERE = "/proc/hebbtorch"  # where no process can make files, whoever runs it
CONFIG = EvolveConfig(shape="worm-2x1", sensors="low", generations=3, duration=0.5)


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("outputs") / "root"
    folder = write_run(root, CONFIG, [1.0, 2.0], "run")
    write_evaluation(folder, CONFIG, [[1.0, 1.1], [2.0, 2.1]])
    pack(root, root.with_name("packed"))
    return root


@pytest.mark.parametrize(
    "command",
    [
        "evolve --out {nowhere}/run",
        "evaluate {root}/run --out {nowhere}.csv",
        "freeze {root}/run --out {nowhere}.csv",
        "render {root}/run --out {nowhere}",
        "report {root}/run --out {nowhere}.html",
        "report {root} --out {nowhere}.html",
        "figures {root} --out {nowhere}",
        "pack {root} --out {nowhere}/packed",
        "unpack {root}/../packed --out {nowhere}",
        "campaign effectiveness --out {nowhere}",
        "validate --out {nowhere}",
        "validate --json {nowhere}.json",
        "bench --quick --out {nowhere}",
        "bench --quick --json {nowhere}.json",
        "soak --minutes 0.1 --out {nowhere}",
        "soak --minutes 0.1 --json {nowhere}.json",
    ],
)
def test_an_unwritable_place_is_told_before_the_work(
    root: Path, command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def work(*_: Any, **__: Any) -> None:
        raise AssertionError("it simulates")

    monkeypatch.setattr(physics.Simulator, "_play", work)
    monkeypatch.setattr(physics.Simulator, "run_closed_loop", work)
    words = command.format(root=root, nowhere=NOWHERE).split()
    monkeypatch.setattr(sys, "argv", ["hebbtorch", *words])
    with pytest.raises(SystemExit) as exit_:
        cli.main()
    assert exit_.value.code == 2
    told = capsys.readouterr().err
    assert "/proc" in told
    assert len(told.splitlines()) == 1


def test_a_place_that_can_be_written_stays_as_it_is(tmp_path: Path) -> None:
    require_folder(tmp_path)
    require_folder(tmp_path / "new" / "folder")
    require_folder(Path("relative"))
    assert list(tmp_path.iterdir()) == []
    make_room(tmp_path / "a" / "table.json", tmp_path / "b")
    assert sorted(each.name for each in tmp_path.iterdir()) == ["a", "b"]


def test_a_file_in_the_way_is_named(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()
    for folder in (file, file / "below"):
        with pytest.raises(ValueError, match="out: .*file"):
            require_folder(folder)
