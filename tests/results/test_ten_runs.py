"""The published results: intact, few and small, and six of their numbers computed again."""

import csv
import hashlib
import io
import math
import re
import zipfile
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from tests.results.published import RESULTS, rows

BUNDLES = sorted(path.parent for path in RESULTS.rglob("SHA256SUMS"))
TEN_RUNS = RESULTS / "ten-runs"
BIPED, WORM = "biped-4x3-low", "worm-7x1-low"
PLACES = [f"{s}-{a}" for s in ("biped-4x3", "worm-7x1") for a in ("low", "medium", "high")]


def by_condition(column: str) -> dict[str, np.ndarray]:
    found = defaultdict(list)
    for row in rows(TEN_RUNS / "runs.csv"):
        found[row["condition"]].append(float(row[column]))
    return {name: np.array(values) for name, values in found.items()}


def table(name: str, **where: str) -> dict[str, str]:
    (row,) = (
        row
        for row in rows(TEN_RUNS / "figures" / f"{name}.csv")
        if all(row[column] == value for column, value in where.items())
    )
    return row


def pages(number: str) -> list[str]:
    """The lines that the report has on a claim."""
    text = (TEN_RUNS / "figures" / "REPORT.md").read_text(encoding="utf-8")
    return re.split(r"\n## ", text.split(f"\n## {number}. ")[1])[0].splitlines()


def _is_drawn_again(path: Path) -> bool:
    """What `hebbtorch figures` puts beside the published files of a campaign."""
    again = path.suffix in (".pdf", ".md") and path.name != "REPORT.md"
    return again and path.parent.name == "figures"


def test_results_are_few_small_and_intact() -> None:
    files = [path for path in RESULTS.rglob("*") if path.is_file() and not _is_drawn_again(path)]
    assert len(files) < 150
    assert sum(path.stat().st_size for path in files) < 25e6
    assert BUNDLES
    for bundle in BUNDLES:
        for line in (bundle / "SHA256SUMS").read_text().splitlines():
            expected, name = line.split()
            assert hashlib.sha256((bundle / name).read_bytes()).hexdigest() == expected, name


def test_mann_whitney_and_effect_size() -> None:
    speeds = by_condition("speed")
    ours, theirs = speeds[f"{BIPED}-hebbian"], speeds[f"{BIPED}-mlp"]
    expected = stats.mannwhitneyu(ours, theirs)
    published = table("effectiveness", where="biped-4x3 low")
    assert float(published["p"]) == pytest.approx(expected.pvalue)
    assert float(published["a12"]) == pytest.approx(np.greater.outer(ours, theirs).mean())


def test_correction_for_six_places() -> None:
    speeds = by_condition("speed")
    p = sorted(
        (stats.mannwhitneyu(speeds[f"{each}-hebbian"], speeds[f"{each}-mlp"]).pvalue, each)
        for each in PLACES
    )
    corrected, least = {}, 0.0
    for rank, (value, place) in enumerate(p):
        least = max(least, (len(p) - rank) * value)
        corrected[place] = min(least, 1.0)
    for place in PLACES:
        where = " ".join(place.rsplit("-", 1))
        published = table("effectiveness", where=where)
        assert float(published["p_holm"]) == pytest.approx(corrected[place]), place


def test_shift_in_the_report_on_the_first_claim() -> None:
    speeds = by_condition("speed")
    ours, theirs = speeds["worm-7x1-high-hebbian"], speeds["worm-7x1-high-mlp"]
    differences = np.sort(np.subtract.outer(ours, theirs).ravel())
    # The interval holds the shifts that the exact test does not reject: for 10 against 10 all but
    # the 23 smallest and the 23 greatest differences (tables of U at 0.05).
    rejected = 0
    while stats.mannwhitneyu(*_with_u(rejected, 10, 10), method="exact").pvalue <= 0.05:
        rejected += 1
    low, high = differences[rejected - 1], differences[-rejected]
    line = next(line for line in pages("1") if line.startswith("- worm-7x1 high:"))
    assert f"shift [{low:.3g}, {high:.3g}]" in line
    assert f"margin {0.2 * np.median(theirs):.3g}" in line


def _with_u(u: int, n1: int, n2: int) -> tuple[np.ndarray, np.ndarray]:
    """Samples without ties whose U is u: all below, but for as many steps up as it takes."""
    first = [-(n1 - i) for i in range(n1)]
    k = n1 - 1
    while u > 0:
        step = min(u, n2)
        first[k] = step - 0.5 + 0.01 * k
        u, k = u - step, k - 1
    return np.array(first, float), np.arange(n2, dtype=float)


def test_median_on_unseen_terrains() -> None:
    with zipfile.ZipFile(TEN_RUNS / "tables.zip") as archive:
        text = archive.read(f"{WORM}-hebbian/evaluation-hilly-3-30-none.csv").decode()
    of_run = defaultdict(list)
    for row in csv.DictReader(io.StringIO(text)):
        of_run[row["run"]].append(float(row["speed"]))
    medians = np.array([np.median(own) for own in of_run.values()])
    assert by_condition("unseen")[f"{WORM}-hebbian"] == pytest.approx(medians)
    published = table("generalization", where="worm-7x1 low")
    assert float(published["median_first"]) == pytest.approx(np.median(medians))


def test_log_rank_of_takeoff() -> None:
    samples = []
    with zipfile.ZipFile(TEN_RUNS / "tables.zip") as archive:
        for controller in ("hebbian", "mlp"):
            text = archive.read(f"{BIPED}-{controller}/history.csv").decode()
            first: dict[str, int] = {}
            last = 0
            for row in csv.DictReader(io.StringIO(text)):
                last = max(last, int(row["generation"]))
                if float(row["best"]) > 1:
                    first.setdefault(row["run"], int(row["generation"]))
            samples.append(
                stats.CensoredData(
                    uncensored=list(first.values()), right=[last] * (10 - len(first))
                )
            )
    published = table("takeoff", where="biped-4x3 low", controller="Hebbian")
    assert float(published["p"]) == pytest.approx(stats.logrank(*samples).pvalue)
    generations = by_condition("takeoff_generation")[f"{BIPED}-mlp"]
    assert int(table("takeoff", where="biped-4x3 low", controller="MLP")["took_off"]) == sum(
        not math.isnan(each) for each in generations
    )


def test_interquartile_mean_over_apparatuses() -> None:
    speeds = by_condition("speed")
    together = np.concatenate([speeds[f"{each}-mlp"] for each in PLACES if "worm" in each])
    published = table("profiles", shape="worm-7x1", controller="MLP")
    assert float(published["iqm"]) == pytest.approx(stats.trim_mean(together, 0.25))
