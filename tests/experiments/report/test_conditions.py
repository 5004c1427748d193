"""The table with a line for every condition."""

from dataclasses import replace
from pathlib import Path

from experiments.config import EvolveConfig
from experiments.report.conditions import condition_rows, readable_rows
from experiments.report.finished_runs import find_runs, gather
from experiments.report.gallery import draw_all
from tests.experiments.finished_runs import read_csv, write_csv, write_evaluation, write_run

SMALL = EvolveConfig(generations=4, population=8)


def test_a_condition_that_was_measured_in_full(root: Path) -> None:
    folder = write_run(root, SMALL, [4.0, 2.0, 0.5])  # above 1 m/s in generations 2 and 3, never
    write_evaluation(folder, SMALL, [[3.0, 3.5, 1.0], [1.0, 2.0, 0.0], [0.1, 0.2, 0.3]])
    nan = float("nan")
    gaits = [(0, 2.0), (0, 4.0), (0, nan), (1, 5.0), (1, 6.0), (2, nan), (2, nan), (2, 9.0)]
    write_csv(folder / "gaits.csv", ["run", "gait_frequency"], gaits)
    (row,) = condition_rows(gather(find_runs([root])))
    assert row == {
        "where": "biped-4x3 low", "controller": "Hebbian", "damage": "none", "n": 3,
        "speed": 2.0, "speed_min": 0.5, "speed_max": 4.0,
        "unseen": 1.0, "unseen_min": 0.2, "unseen_max": 3.0,
        "took_off": 2, "first": 2, "half": 3, "last": 3,
        "periodic": 2, "frequency": 4.25,  # medians 3 and 5.5; the third has no gait
    }  # fmt: skip

    (told,) = readable_rows(gather(find_runs([root])))
    assert list(told.values())[4:] == [
        "2.0 (0.5 to 4.0)", "1.0 (0.2 to 3.0)", "2", "3 (2 to 3)", "4.2 (2)",
    ]  # fmt: skip


def test_what_was_not_measured_stays_empty(root: Path) -> None:
    folder = write_run(root, replace(SMALL, damage="half"), [0.5, float("nan")])
    (folder / "history.csv").unlink()
    (row,) = condition_rows(gather(find_runs([root])))
    assert (row["damage"], row["speed_min"], row["speed_max"]) == ("half", 0.5, 0.5)
    assert {name for name, value in row.items() if value == ""} == {
        "unseen", "unseen_min", "unseen_max", "took_off", "first", "half", "last",
        "periodic", "frequency",
    }  # fmt: skip


def test_runs_without_a_gait_have_no_generation_of_it(root: Path) -> None:
    write_run(root, SMALL, [0.5, 0.5])
    (row,) = condition_rows(gather(find_runs([root])))
    assert (row["took_off"], row["first"], row["half"], row["last"]) == (0, "", "", "")
    (told,) = readable_rows(gather(find_runs([root])))
    assert (told["above 1 m/s"], told["from generation"]) == ("0", "")


def test_the_table_is_written_and_stands_in_the_report(root: Path, out: Path) -> None:
    write_run(root, SMALL, [4.0, 2.0])
    draw_all([root], out, 0, all_formats=False)
    (row,) = read_csv(out / "conditions.csv")
    assert (row["controller"], float(row["speed"]), row["unseen"]) == ("Hebbian", 3.0, "")
    assert not (out / "conditions.md").exists()
    section = (out / "REPORT.md").read_text(encoding="utf-8").split("## Every condition")[1]
    assert (
        "| biped-4x3 low | Hebbian | none | 2 | 3.0 (2.0 to 4.0) |  | 2 | 2 (2 to 3) |  |"
        in section.split("\n## ")[0]
    )
