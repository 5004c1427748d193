"""Plain progress lines, as in a log file."""

import re

import pytest

from experiments.evolution.progress import ProgressDisplay
from experiments.runs.history import Row


def rows(generation: int, *bests: float) -> list[Row]:
    return [
        Row(run, generation, best, best - 1, 0.0, 0.0, 0, 0.0) for run, best in enumerate(bests)
    ]


def test_first_and_last_generation_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    with ProgressDisplay(generations=5, done=0) as progress:
        for generation in range(1, 6):
            progress.show(rows(generation, 0.1 * generation), 123.4)
    first, last = capsys.readouterr().out.splitlines()  # within a few ms: nothing between
    assert re.match(r"generation 1/5  best 0\.10 m/s  median -0\.90 m/s  123 evaluations/s", first)
    assert re.match(r"generation 5/5  best 0\.50 m/s", last)
    assert last.endswith("0 s left")


def test_of_several_runs_the_best_and_the_median_of_medians(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with ProgressDisplay(generations=1, done=0) as progress:
        progress.show(rows(1, float("nan"), 3.0, 5.0, 4.0)[1:], 1.0)
        progress.show(rows(1, 2.0, float("nan")), 1.0)
    whole, with_failed_run = capsys.readouterr().out.splitlines()
    assert "best 5.00 m/s  median 3.00 m/s" in whole
    assert "best 2.00 m/s" in with_failed_run


def test_without_a_stdout_nothing_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdout", None)
    with ProgressDisplay(generations=1, done=0) as progress:
        progress.show(rows(1, 0.5), 1.0)
