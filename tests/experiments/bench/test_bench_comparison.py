"""The bench against another checkout: what it makes of times, and who simulates what."""

import json
from pathlib import Path

import pytest

from experiments.bench import comparison
from experiments.bench.comparison import Comparison
from tests.experiments.bench.benches import MACHINE, TINY
from tests.experiments.commands import hebbtorch

ROWS = [
    Comparison("gait", (2.0, 3.0, 4.0), (1.0, 2.0, 4.0), same_bits=True),
    Comparison("flight", (1.0,), (2.0,), same_bits=False),
]
# A program whose poses are the number of steps taken, times a factor of its own.
_WORKLOAD = """
from array import array
from types import SimpleNamespace

class OpenLoop:
    def __init__(self, shape, worlds, seed):
        self.steps = 0
        self.sim = SimpleNamespace(mass_poses=lambda: self)

    def contiguous(self):
        return self

    def numpy(self):
        return array("d", [self.steps * FACTOR])

    def stretch(self, steps):
        def call():
            self.steps += steps
            sum(range(100_000))
        return call
"""


def checkout(folder: Path, factor: float) -> Path:
    """The folder of such a program."""
    for name, text in (
        ("physics/__init__.py", ""),
        ("experiments/bench/__init__.py", ""),
        ("experiments/bench/workload.py", _WORKLOAD.replace("FACTOR", str(factor))),
    ):
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    return folder


def test_figures() -> None:
    gait, flight = ROWS
    assert gait.ratios == [2.0, 1.5, 1.0]
    assert (gait.ratio, gait.quartiles) == (1.5, (1.25, 1.75))
    assert (flight.ratio, flight.quartiles) == (0.5, (0.5, 0.5))


def test_markdown_and_json(tmp_path: Path) -> None:
    lines = comparison.markdown(MACHINE, Path("old"), ROWS).splitlines()
    assert "| gait | 1.500 | 1.250 - 1.750 | 3 | 3.000 | 2.000 | yes |" in lines
    assert "| flight | 0.500 | 0.500 - 0.500 | 1 | 1.000 | 2.000 | NO |" in lines
    comparison.write_json(tmp_path / "a.json", MACHINE, tmp_path, 7, ROWS)
    content = json.loads((tmp_path / "a.json").read_text())
    assert content["format"] == 1
    assert (content["seed"], content["against"]) == (7, str(tmp_path.resolve()))
    assert [(row["ratio"], row["same_bits"]) for row in content["rows"]] == [
        (1.5, True),
        (0.5, False),
    ]


def test_each_process_runs_the_program_of_its_checkout(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here, same, other = (
        checkout(tmp_path / name, factor) for name, factor in (("a", 1.0), ("b", 1.0), ("c", 2.0))
    )
    monkeypatch.setattr(comparison, "_HERE", here)
    row = comparison.compare(same, TINY, "open", "worm-2x1")
    assert (row.what, row.same_bits) == ("open loop, worm-2x1, 16 worlds", True)
    assert min(*row.there, *row.here) > 0.0
    assert len(row.there) == len(row.here) == TINY.pairs
    assert not comparison.compare(other, TINY, "open", "worm-2x1").same_bits
    with pytest.raises(ValueError, match="a checkout of hebbtorch that can run, got .*OwnModule"):
        comparison.compare(other, TINY, "own", "worm-2x1")


def test_a_folder_that_is_no_checkout(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "table"
    assert hebbtorch(f"bench --against {tmp_path} --out {out}", monkeypatch) == 2
    assert "against: expected a checkout of hebbtorch with exp" in capsys.readouterr().err
    assert not out.exists()


def test_a_checkout_is_not_completed_with_what_is_installed(tmp_path: Path) -> None:
    incomplete = checkout(tmp_path / "a", 1.0)
    file = incomplete / "experiments/bench/workload.py"
    file.write_text("import experiments.runs.history\n" + file.read_text())
    with pytest.raises(ValueError, match="No module named 'experiments.runs'"):
        comparison.compare(incomplete, TINY, "open", "worm-2x1")
