"""The published results: intact, few and small, and six of their numbers computed again.

Nothing of this project computes here: only csv, numpy and scipy read what was published.
"""

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

RESULTS = Path(__file__).parents[1] / "experiments" / "results"
BUNDLES = sorted(path.parent for path in RESULTS.rglob("SHA256SUMS"))
TEN_RUNS = RESULTS / "ten-runs"
BIPED, WORM = "biped-4x3-low", "worm-7x1-low"
PLACES = [f"{s}-{a}" for s in ("biped-4x3", "worm-7x1") for a in ("low", "medium", "high")]


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


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


CONTROLS, FULL = RESULTS / "controls", RESULTS / "full-scale"
ACTS = {"every step": "", "every 2nd": "-interval-2", "every 4th": "-interval-4"}
ACTS["every 12th"] = "-interval-12"
NETWORKS = {
    "Hebbian": "hebbian",
    "MLP": "mlp",
    "MLP, gain 10": "mlp-gain-10",
    "MLP, gain 30": "mlp-gain-30",
    "MLP, gain 30, biases": "mlp-gain-30-bias",
    "recurrent, gain 30": "rnn-gain-30",
}


def report_rows(heading: str) -> list[list[str]]:
    """The cells of the first table under a heading of the report, without its head."""
    text = (RESULTS / "REPORT.md").read_text(encoding="utf-8")
    _, section = re.split(rf"\n#+ {re.escape(heading)}.*\n", text)
    _, table = re.split(r"\n\|[-|]+\|\n", section, maxsplit=1)
    lines = re.split(r"\n\n", table)[0].splitlines()
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


class Published:
    """What the report tells of the conditions of a packed campaign, by scipy and numpy alone."""

    def __init__(self, bundle: Path) -> None:
        self.runs = defaultdict(list)
        for row in rows(bundle / "runs.csv"):
            self.runs[row["condition"]].append((float(row["speed"]), float(row["unseen"])))
        with zipfile.ZipFile(bundle / "tables.zip") as archive:
            self.takeoff = {name: _takeoffs(archive, name) for name in self.runs}
            self.hertz = {
                name: _per_run(archive, f"{name}/gaits.csv", "gait_frequency") for name in self.runs
            }

    def cells(self, name: str) -> list[str]:
        """Final speed, that on 40 terrains, generation of the take-off, frequency."""
        speeds, unseen = np.array(self.runs[name]).T
        assert len(speeds) == 10
        low, middle, high = (f"{f(speeds):.1f}" for f in (np.min, np.median, np.max))
        half = sorted(self.takeoff[name])[4]  # the fifth of ten runs
        ever = sum(map(math.isfinite, self.takeoff[name]))
        hertz = self.hertz[name]
        return [
            f"{middle} ({low} to {high})",
            f"{np.median(unseen):.1f}",
            f"{half:g}" if math.isfinite(half) else f"{ever} of 10 ever",
            f"{np.median(hertz):.1f}" + (f" ({len(hertz)})" if len(hertz) < 10 else ""),
        ]


@pytest.mark.parametrize(
    ("heading", "sensors", "least"), [("Is it plasticity?", "low", 14), ("With many", "high", 4)]
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


def test_the_table_of_the_full_scale_is_that_of_the_runs() -> None:
    published = Published(FULL)
    found = report_rows("At the paper's full scale")
    bodies = {"biped": "biped-4x3", "worm": "worm-7x1"}
    names = []
    for where, network, *cells in found:
        body, sensors = where.split()
        names.append(f"{bodies[body]}-{sensors}-{NETWORKS[network]}")
        assert cells == published.cells(names[-1]), names[-1]
    assert len(set(names)) == 12


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
            still[name] = [sum(row["end"] == end for row in slow) for end in ("60.0", "600.0")]
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


def _takeoffs(archive: zipfile.ZipFile, name: str) -> list[float]:
    """The generation in which each run was above 1 m/s for the first time."""
    first: dict[str, float] = {}
    for row in csv.DictReader(io.StringIO(archive.read(f"{name}/history.csv").decode())):
        first.setdefault(row["run"], math.inf)
        if float(row["best"]) > 1:
            first[row["run"]] = min(first[row["run"]], int(row["generation"]))
    return list(first.values())


def _per_run(archive: zipfile.ZipFile, name: str, column: str) -> list[float]:
    """Median over the terrains of each run that has such a number on at least half of them."""
    of_run = defaultdict(list)
    for row in csv.DictReader(io.StringIO(archive.read(name).decode())):
        of_run[row["run"]].append(float(row[column]))
    known = [(own, [each for each in own if math.isfinite(each)]) for own in of_run.values()]
    return [float(np.median(each)) for own, each in known if 2 * len(each) >= len(own)]


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
            assert f"{np.median(_per_run(archive, name, 'speed')):.1f}" == expected
    report = (RESULTS / "REPORT.md").read_text(encoding="utf-8")
    section = report.split("A champion of one interval")[1].split("\n\n")[0]
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
