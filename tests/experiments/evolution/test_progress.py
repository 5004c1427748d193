"""Plain progress lines, as in a log file."""

import re
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from experiments.evolution.progress import ProgressDisplay, counted
from experiments.io import terminal
from experiments.runs.history import HistoryRow


def rows(generation: int, *bests: float) -> list[HistoryRow]:
    return [
        HistoryRow(run, generation, best, best - 1, 0.0, 0.0, 0, 0.0)
        for run, best in enumerate(bests)
    ]


@pytest.fixture(autouse=True)
def _nothing_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ProgressDisplay, "_compiled", False)


class Clock:
    """Tells what it is set to."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


def test_first_and_last_generation_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    with ProgressDisplay(generations=5, done=0) as progress:
        for generation in range(1, 6):
            progress.show(rows(generation, 0.1 * generation), 123.4)
    compiling, first, last = capsys.readouterr().out.splitlines()  # within ms: nothing between
    assert compiling.startswith("compiling the simulator")
    assert first == "generation 1/5  best 0.10  median -0.90 m/s"
    assert re.match(r"generation 5/5  best 0\.50  median -0\.50 m/s  123/s", last)
    assert last.endswith("0:00 left")


def test_time_left_follows_from_the_last_generations_without_the_compilation(
    capsys: pytest.CaptureFixture[str],
) -> None:
    clock = Clock()
    with ProgressDisplay(generations=100, done=0, interval=0.0, clock=clock) as progress:
        clock.now = 60.0  # of which compiling took almost all
        progress.show(rows(1, 1.0), 1.0)
        for generation in range(2, 31):
            clock.now += 2.0
            progress.show(rows(generation, 1.0), 1.0)
        for generation in range(31, 41):  # it gets slower: after ten only that counts
            clock.now += 90.0
            progress.show(rows(generation, 1.0), 1.0)
    lines = capsys.readouterr().out.splitlines()
    assert "left" not in lines[1]
    assert lines[2].endswith("  3:16 left")  # 98 generations of 2 s
    assert lines[30].endswith("  2:20 left")
    assert lines[40].endswith("  1:30:00 left")


def test_lines_fit_70_columns(capsys: pytest.CaptureFixture[str]) -> None:
    clock = Clock()
    with ProgressDisplay(generations=500, done=498, interval=0.0, clock=clock) as progress:
        for generation in (499, 500):
            clock.now += 4000.0
            progress.show(rows(generation, 11.11, 12.5), 1234.0)
    assert max(map(len, capsys.readouterr().out.splitlines())) <= 70


def test_of_several_runs_the_best_and_the_median_of_medians(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with ProgressDisplay(generations=1, done=0) as progress:
        progress.show(rows(1, float("nan"), 3.0, 5.0, 4.0)[1:], 1.0)
        progress.show(rows(1, 2.0, float("nan")), 1.0)
    _, whole, with_failed_run = capsys.readouterr().out.splitlines()
    assert "best 5.00  median 3.00 m/s" in whole
    assert "best 2.00  median" in with_failed_run


def test_compiling_is_told_once(capsys: pytest.CaptureFixture[str]) -> None:
    for _ in range(2):
        with ProgressDisplay(generations=1, done=0) as progress:
            progress.show(rows(1, 1.0), 1.0)
    assert capsys.readouterr().out.count("compiling") == 1


def test_without_a_stdout_nothing_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdout", None)
    with ProgressDisplay(generations=1, done=0) as progress:
        progress.show(rows(1, 0.5), 1.0)
    with counted("picture") as tell:
        tell(1, 2)


def test_quiet_is_quiet(capsys: pytest.CaptureFixture[str]) -> None:
    with terminal.quiet():
        with ProgressDisplay(generations=1, done=0) as progress:
            progress.show(rows(1, 0.5), 1.0)
        terminal.say("something")
        print("something")
    assert capsys.readouterr().out == ""
    terminal.say("again")
    assert capsys.readouterr().out == "again\n"


def test_a_film_is_shown_in_a_notebook(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    shown: list[str] = []
    display = SimpleNamespace(Image=lambda filename: filename, display=shown.append)
    terminal.show_in_notebook(tmp_path / "a.gif")  # no notebook: nothing is imported
    monkeypatch.setitem(sys.modules, "ipykernel", SimpleNamespace())
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    for name in ("a.gif", "a.mp4"):
        terminal.show_in_notebook(tmp_path / name)
    assert shown == [str(tmp_path / "a.gif")]
