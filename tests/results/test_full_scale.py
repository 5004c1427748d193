"""What the report tells of the paper's full scale, computed again from the published files."""

import csv
import io
import re
import zipfile
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from tests.results.published import FULL, RESULTS, Published, condition, report_rows, rows


@pytest.mark.parametrize(
    ("heading", "count"), [("At the paper's full scale", 12), ("The networks of the authors", 4)]
)
def test_the_tables_of_the_full_scale_are_those_of_the_runs(heading: str, count: int) -> None:
    published = Published(FULL)
    found = report_rows(heading)
    names = []
    for where, network, *cells in found:
        names.append(condition(where, network))
        assert cells == published.cells(names[-1]), names[-1]
    assert len(set(names)) == count


def test_the_static_network_of_the_authors_code() -> None:
    """Against that of the text, and the plastic one of the code against that of the text."""
    speeds = {name: [speed for speed, _ in own] for name, own in Published(FULL).runs.items()}
    told = (RESULTS / "REPORT.md").read_text(encoding="utf-8")
    told = told.split("## The networks of the authors' code")[1].split("\n## ")[0]
    told = " ".join(told.split())
    for shape, words in (("biped-4x3", "(p {:.1g})"), ("worm-7x1", "0.1 m/s, p {:.2g})")):
        static = (f"{shape}-low-mlp-bias-inputs-tanh", f"{shape}-low-mlp")
        p = stats.mannwhitneyu(*(speeds[name] for name in static)).pvalue
        assert words.format(p) in told
        names = (f"{shape}-low-hebbian-bc-exchanged-constant-input", f"{shape}-low-hebbian")
        p = stats.mannwhitneyu(*(speeds[name] for name in names)).pvalue
        assert f"p {p:.2g} both" in told


def test_verdicts_in_the_report_are_those_of_the_campaigns() -> None:
    generated = [_verdicts(RESULTS / name) for name in ("full-scale", "ten-runs")]
    found = report_rows("Verdicts")
    assert len(found) > 10
    for numbers, _, *told in found:
        for number in re.findall(r"\d+[ab]?", numbers) if "-" not in numbers else []:
            for words, verdict in zip(told, generated, strict=True):
                (own,) = re.findall(r"\*\*(\w+)\*\*", words) or ["open"]  # not measured yet
                assert own == verdict[number], number


def _verdicts(bundle: Path) -> dict[str, str]:
    text = (bundle / "figures" / "REPORT.md").read_text(encoding="utf-8")
    return dict(re.findall(r"\n## (\d+[ab]?)\. .*\n\n- \*\*Verdict\*\*: (\w+)", text))


def test_when_a_gait_is_found_is_that_of_the_full_scale() -> None:
    found = report_rows("When a gait is found")
    assert len(found) == 6
    for where, *told, p in found:
        body, sensors = where.split()
        shape = {"biped": "biped-4x3", "worm": "worm-7x1"}[body]
        for words, controller in zip(told, ("Hebbian", "MLP"), strict=True):
            (row,) = (
                row
                for row in rows(FULL / "figures" / "takeoff.csv")
                if (row["where"], row["controller"]) == (f"{shape} {sensors}", controller)
            )
            half = row["median_generation"]
            generation = "" if half == "nan" else f", generation {float(half):g}"
            assert words == f"{row['took_off']} of {row['n']}{generation}", where
            if controller == "Hebbian":
                assert float(p) == float(f"{float(row['p_holm']):.1g}"), where


def test_bipeds_that_fell_over_in_long_episodes() -> None:
    told = (RESULTS / "REPORT.md").read_text(encoding="utf-8").split("**Bipeds fall over")[1]
    still = {}
    with zipfile.ZipFile(FULL / "tables.zip") as archive:
        for name in ("biped-4x3-high-hebbian", "biped-4x3-high-mlp", "worm-7x1-high-hebbian",
                     "worm-7x1-high-mlp"):  # fmt: skip
            table = csv.DictReader(io.StringIO(archive.read(f"{name}/endurance.csv").decode()))
            slow = [row for row in table if abs(float(row["speed"])) < 1]
            still[name] = [sum(float(row["end"]) == end for row in slow) for end in (60, 600)]
    (early, plastic), (before, static), (_, worms), (_, others) = still.values()
    words = " ".join(told.split())
    assert f"{plastic} of 30 plastic and {static} of 30 static bipeds" in words
    assert f"{early} and {before} at the end of the 60 s" in words
    assert f"{worms} plastic and {others} static ones of 30" in words


def test_weights_frozen_late_no_longer_move_some_bipeds() -> None:
    speeds = defaultdict(list)
    with zipfile.ZipFile(FULL / "tables.zip") as archive:
        text = archive.read("biped-4x3-high-hebbian/freeze.csv").decode()
        recording = np.load(io.BytesIO(archive.read("biped-4x3-high-hebbian/recording.npz")))
        x = recording["way"][:, :, 0]  # while they learned, at every control step
    for row in csv.DictReader(io.StringIO(text)):
        speeds[row["run"], float(row["second"])].append(float(row["speed"]))
    runs = sorted({run for run, _ in speeds})
    medians = {
        first: [
            np.median([np.median(speeds[run, s]) for s in range(first, last + 1)]) for run in runs
        ]
        for first, last in ((5, 15), (46, 60))
    }
    still = np.array(medians[46]) < 0.2
    assert still.sum() == 3
    assert runs == [str(run) for run in range(10)]
    assert ((x[still, -1] - x[still, 46 * 60]) / 14 > 1).sum() == 2  # 14 s at their end
    assert f"{min(medians[5]):.1f}" == "1.7"
    told = (RESULTS / "REPORT.md").read_text(encoding="utf-8").split("Later is not better")[1]
    assert "3 of 10 bipeds (below" in told
    assert "(1.7 m/s and" in told
    assert "One of the three had fallen over while it learned, the other two ran on" in told
