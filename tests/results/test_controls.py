"""What the report tells of the controls, computed again from the published files."""

import re
import zipfile
from collections import defaultdict

import numpy as np
import pytest
from scipy import stats

from tests.results.published import (
    ACTS,
    CONTROLS,
    NETWORKS,
    RESULTS,
    Published,
    per_run,
    report_rows,
    rows,
)


@pytest.mark.parametrize(
    ("heading", "sensors", "least"), [("Is it plasticity?", "low", 14), ("With many", "high", 14)]
)
def test_the_tables_of_controls_are_those_of_the_runs(
    heading: str, sensors: str, least: int
) -> None:
    published = Published(CONTROLS)
    found = report_rows(heading)
    assert len(found) >= least
    for network, acts, *cells in found:
        for shape, own in (("biped-4x3", cells[:4]), ("worm-7x1", cells[4:])):
            name = f"{shape}-{sensors}-{NETWORKS[network]}{ACTS[acts]}"
            assert own == published.cells(name), name


@pytest.mark.parametrize(
    ("condition", "free", "held"),
    [
        ("biped-4x3-low-hebbian", "8.9", "0.7"),
        ("worm-7x1-low-hebbian", "5.3", "0.3"),
        ("biped-4x3-low-mlp-gain-10", "9.1", "0.3"),
        ("worm-7x1-low-mlp-gain-10", "5.2", "0.1"),
    ],
)
def test_champions_whose_actuation_is_held(condition: str, free: str, held: str) -> None:
    """As the report tells."""
    table = f"{condition}/evaluation-hilly-3-30-none-40-seed0"
    with zipfile.ZipFile(CONTROLS / "tables.zip") as archive:
        for name, expected in ((f"{table}.csv", free), (f"{table}-interval-12.csv", held)):
            assert f"{np.median(per_run(archive, name, 'speed')):.1f}" == expected
    report = (RESULTS / "REPORT.md").read_text(encoding="utf-8")
    (paragraph,) = (each for each in re.split(r"\n\n|\n- ", report) if "held for 12 steps" in each)
    section = " ".join(paragraph.split()).split("A champion of one interval")[1]
    assert {free, held} <= set(re.findall(r"\d\.\d", section))


def test_larger_static_weights_against_plastic_ones() -> None:
    speeds = defaultdict(list)
    for row in rows(CONTROLS / "runs.csv"):
        speeds[row["condition"]].append(float(row["speed"]))
    compared = []
    for figure, acts in (("controls", ""), ("controls-12", "-interval-12")):
        for row in rows(CONTROLS / "figures" / f"{figure}.csv"):
            shape, _, sensors = row["where"].partition(" ")
            if sensors != "low" or row["first"].split(", every")[0] != "MLP, gain 10":
                continue
            static = speeds[f"{shape}-low-mlp-gain-10{acts}"]
            plastic = speeds[f"{shape}-low-hebbian{acts}"]
            assert float(row["p"]) == pytest.approx(stats.mannwhitneyu(static, plastic).pvalue)
            assert float(row["a12"]) == pytest.approx(np.greater.outer(static, plastic).mean())
            differences = np.sort(np.subtract.outer(static, plastic).ravel())
            assert float(row["shift"]) == pytest.approx(np.median(differences))
            assert float(row["shift_low"]) == pytest.approx(differences[23])  # tables of U, n 10
            assert float(row["shift_high"]) == pytest.approx(differences[-24])
            compared.append(shape + acts)
    assert len(set(compared)) == 4


def test_static_networks_against_plastic_ones_with_many_sensors() -> None:
    """The tests that the report tells of, and what became of the recurrent worms."""
    speeds = {name: [speed for speed, _ in own] for name, own in Published(CONTROLS).runs.items()}
    told = (RESULTS / "REPORT.md").read_text(encoding="utf-8").split("### With many sensors")[1]
    words = " ".join(told.split("\n## ")[0].split())
    networks = ("mlp", "mlp-gain-10", "mlp-gain-30", "mlp-gain-30-bias", "rnn-gain-30")
    plastic = speeds["biped-4x3-high-hebbian"]
    statics = [speeds[f"biped-4x3-high-{each}"] for each in networks]
    p = [f"{stats.mannwhitneyu(each, plastic).pvalue:.1g}" for each in statics]
    assert f"(p {', '.join(p[:-1])} and {p[-1]}, in the order of the table)" in words
    medians = [np.median(each) for each in statics]
    assert f"{min(medians):.1f} to {max(medians):.1f} against {np.median(plastic):.1f}" in words
    fast = sorted(speed for speed in speeds["worm-7x1-high-rnn-gain-30"] if speed > 5)
    assert len(fast) == 4
    assert f"Four recurrent worms of ten are fast ({fast[0]:.1f} to {fast[-1]:.1f} m/s)" in words
    bipeds = speeds["biped-4x3-high-rnn-gain-30"]
    assert f"{min(bipeds):.1f} to {max(bipeds):.1f} m/s in all ten runs" in words
