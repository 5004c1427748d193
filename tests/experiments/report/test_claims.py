"""Verdicts on the paper's claims: only what is significant, or within bounds, is ever decided."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from experiments.campaign.grid import Scale
from experiments.config import EvolveConfig
from experiments.report import intervals
from experiments.report.claims import CLAIMS, judge, measures, report, verdicts
from experiments.report.claims.evidence import EVIDENCE
from experiments.report.claims.finding import Finding
from experiments.report.conditions import Condition, find_runs, gather
from experiments.report.figures import FIGURES
from experiments.studies.registry import STUDIES
from tests.experiments.finished_runs import (
    write_evaluation,
    write_freezing,
    write_generalization,
    write_inner_life,
    write_paired,
    write_run,
)

NAN = math.nan
NAMES = ("A", "B")
LOW = np.linspace(1.0, 1.1, 10)
HIGH = LOW + 1
BODIES = [(shape, s) for shape in ("biped-4x3", "worm-7x1") for s in ("low", "medium", "high")]
SMALL = EvolveConfig(generations=10, population=8)


def verdict_of(finding: Finding) -> str:
    return finding.verdict.split()[0]


@pytest.mark.parametrize(
    ("first", "second", "higher", "not_lower", "not_higher", "alike"),
    [
        (HIGH, LOW, "supported", "supported", "contradicted", "contradicted"),
        (LOW, HIGH, "contradicted", "contradicted", "supported", "contradicted"),
        # No difference: no test rejects, but the intervals lie within the margin.
        (LOW, LOW, "contradicted", "supported", "supported", "supported"),
        # A significant difference of 0.15, less than the margin of 20 % of 1.05, is none.
        (LOW + 0.15, LOW, "contradicted", "supported", "supported", "supported"),
        # A significant one that may be smaller or greater than the margin decides half of it.
        (LOW + 0.2, LOW, "supported", "supported", "open", "open"),
        (LOW - 0.2, LOW, "contradicted", "open", "supported", "open"),
        # Fewer than ten: nothing is decided, though nine would be significant.
        (HIGH[:3], LOW[:3], "open", "open", "open", "open"),
        (HIGH[:9], LOW, "open", "open", "open", "open"),
        # As different as can be, but as scattered.
        (10 * LOW, np.geomspace(0.1, 1000, 10), "open", "open", "open", "open"),
    ],
)
def test_rules_for_two_samples(
    first: np.ndarray, second: np.ndarray, higher: str, not_lower: str, not_higher: str, alike: str
) -> None:
    samples = {"here": (first, second)}
    for rule, expected in (
        (verdicts.higher, higher),
        (verdicts.not_lower, not_lower),
        (verdicts.not_higher, not_higher),
        (verdicts.alike, alike),
    ):
        assert verdict_of(rule(samples, NAMES)) == expected, rule.__name__


def test_a_claim_holds_everywhere_or_not_at_all() -> None:
    good, bad = (HIGH, LOW), (LOW, HIGH)
    assert verdict_of(verdicts.higher({"a": good, "b": good}, NAMES)) == "supported"
    scattered = (10 * LOW, np.geomspace(0.1, 1000, 10))
    unclear = verdicts.higher({"a": good, "b": scattered}, NAMES)
    assert verdict_of(unclear) == "open"
    assert unclear.reason == "without a significant difference in the claimed direction: b"
    missing = verdicts.higher({"a": good, "b": None}, NAMES)
    assert (verdict_of(missing), missing.reason) == ("open", "not measured: b")
    against = verdicts.higher({"a": good, "b": bad, "c": None}, NAMES)
    assert (verdict_of(against), against.reason) == ("contradicted", "significantly otherwise: b")
    nothing = verdicts.higher({"a": None}, NAMES)
    assert (verdict_of(nothing), nothing.tendency) == ("open", "")


def test_too_few_runs_still_tell_the_direction() -> None:
    finding = verdicts.higher({"here": (HIGH[:3], LOW[:3])}, NAMES)
    assert finding.reason == "fewer than 10 runs: everywhere"
    assert finding.tendency == "as claimed at 1 of 1 place(s): A12 1.00"
    assert "p 0.1" in finding.measured[0]


@pytest.mark.parametrize(
    ("values", "bounds", "expected"),
    [
        (LOW, (0.9, 1.2), "supported"),
        (LOW, (0.0, 0.9), "contradicted"),
        (LOW, (1.05, 2.0), "open"),
        (LOW[:9], (0.0, 2.0), "open"),  # fewer than ten
        (np.append(LOW, [NAN] * 5), (0.0, 2.0), "open"),
        (np.full(10, NAN), (-math.inf, 0.0), "open"),  # undefined is no small number
    ],
)
def test_rule_for_numbers(values: np.ndarray, bounds: tuple[float, float], expected: str) -> None:
    assert verdict_of(verdicts.within({"here": values}, {"here": bounds})) == expected


@pytest.mark.parametrize(
    ("values", "bounds", "expected"),
    [
        (np.append(LOW[:6], [NAN] * 4), (0.9, 1.2), "supported"),
        (np.append(LOW[:6], [NAN] * 4), (1.2, 2.0), "contradicted"),
        (np.append(LOW[:6], [NAN] * 7), (0.9, 1.2), "open"),  # half of the runs have no number
        (np.full(10, NAN), (0.9, 1.2), "open"),
    ],
)
def test_runs_without_a_number_are_left_out_and_counted(
    values: np.ndarray, bounds: tuple[float, float], expected: str
) -> None:
    finding = verdicts.within({"here": values}, {"here": bounds}, undefined="left out")
    assert verdict_of(finding) == expected
    assert f"({np.isnan(values).sum()} more have none)" in finding.measured[0]


def test_places_of_a_claim_are_corrected_by_holm() -> None:
    # Outside at one place with p 0.021 (nine of ten): one of three such is no longer significant.
    values = np.append(LOW[:9], 5.0)
    bounds = (2.0, 6.0)
    assert verdict_of(verdicts.within({"a": values}, {"a": bounds})) == "contradicted"
    samples = {"a": values, "b": LOW, "c": LOW}
    inside = (0.9, 1.2)
    three = verdicts.within(samples, {"a": bounds, "b": inside, "c": inside})
    assert verdict_of(three) == "open"


def test_rule_for_gains() -> None:
    much, little = {"here": (HIGH, LOW)}, {"here": (LOW + 0.1, LOW)}
    names = ("biped", "worm")
    assert verdict_of(verdicts.greater_gain(much, little, names)) == "supported"
    assert verdict_of(verdicts.greater_gain(little, much, names)) == "contradicted"
    assert verdict_of(verdicts.greater_gain(much, much, names)) == "open"
    # Gains are shares: 1 of 2.05 and 0.1 of 1.15.
    assert verdicts.greater_gain(much, little, names).tendency.endswith("gains 0.488 against 0.087")


def condition(folder: Path) -> Condition:
    (found,) = gather([folder])
    return found


def gains_that_differ(by: float) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
    """Runs of a group with gains around `by` times 1e-3, and of one with gains around 0."""
    second = 1000 + np.arange(12.0) ** 1.3
    first = 1000 + np.arange(12.0) ** 1.2
    return (first + by, second), (first, second)


def smallest_difference(alpha: float) -> float:
    """How far the gains of both groups must be apart for their intervals not to overlap."""
    differences = np.linspace(0, 30, 3001)
    for by in differences:
        (one, second), (other, _) = gains_that_differ(float(by))
        a, b = (intervals.shift(first, second, alpha=alpha) for first in (one, other))
        if a.low / np.median(one) > b.high / np.median(other):
            return float(by)
    raise AssertionError


def test_two_intervals_have_half_of_the_level_each() -> None:
    """A difference that intervals at the whole level would show is not enough."""
    whole, half = smallest_difference(0.05), smallest_difference(0.025)
    assert whole < half - 0.02
    much, little = gains_that_differ((whole + half) / 2)
    assert verdict_of(verdicts.greater_gain({"a": much}, {"a": little}, ("one", "other"))) == "open"
    much, little = gains_that_differ(half + 0.1)
    finding = verdicts.greater_gain({"a": much}, {"a": little}, ("one", "other"))
    assert verdict_of(finding) == "supported"


def test_a_gain_is_contradicted_at_the_level_of_all_places_together() -> None:
    one_place, two_places = smallest_difference(0.025), smallest_difference(0.0125)
    assert one_place < two_places - 0.02
    much, little = gains_that_differ((one_place + two_places) / 2)
    alone = verdicts.greater_gain({"a": little}, {"a": much}, ("one", "other"))
    assert verdict_of(alone) == "contradicted"
    both = verdicts.greater_gain(
        {"a": little, "b": little}, {"a": much, "b": much}, ("one", "other")
    )
    assert verdict_of(both) == "open"


def test_frozen_and_plastic_speeds_are_compared_on_the_same_terrains(tmp_path: Path) -> None:
    folder = write_run(tmp_path, SMALL, [10.0, 4.0, -1.0])
    write_paired(folder, plastic=[8.0, 4.0, -1.0], frozen=[4.0, 4.0, 1.0])
    found = condition(folder)
    assert measures.kept_frozen(found).tolist() == pytest.approx([0.5, 1.0, NAN], nan_ok=True)


def test_measures_of_a_frozen_life(tmp_path: Path) -> None:
    folder = write_run(tmp_path, SMALL, [10.0, 4.0, -1.0])
    rising = [0.0] * 5 + [5.0] * 25  # reaches its plateau at second 5
    slow = [0.0] * 15 + [3.9] * 3 + [4.0] * 12  # 80 % of it at second 15
    write_freezing(folder, [rising, slow, [-1.0] * 30])
    found = condition(folder)
    assert measures.second_settled(found).tolist() == pytest.approx([5, 15, NAN], nan_ok=True)


def test_a_short_life_says_nothing_about_settling(tmp_path: Path) -> None:
    folder = write_run(tmp_path, SMALL, [10.0])
    write_freezing(folder, [[0.0, 1.0, 2.0]])
    assert len(measures.second_settled(condition(folder))) == 0


def test_measures_of_evolution_and_of_unseen_terrains(tmp_path: Path) -> None:
    folder = write_run(tmp_path, SMALL, [10.0, 5.0])
    write_evaluation(folder, SMALL, [[7, 9, 8], [1, NAN, 5]])
    found = condition(folder)
    # The history rises evenly through ten generations: 90 % of the last one is the ninth.
    assert measures.generations_to_converge(found).tolist() == [9, 9]
    assert measures.speed_on_unseen(found).tolist() == [8, 1]


def test_convergence_is_told_by_the_last_tenth_of_the_generations(tmp_path: Path) -> None:
    """Of 40 generations that rise evenly, the last four have a mean of 38.5/40, and 90 % of that is
    reached in the 35th; of the last two or the last eight it would be the 36th or the 33rd."""
    folder = write_run(tmp_path, replace(SMALL, generations=40), [10.0])
    assert measures.generations_to_converge(condition(folder)).tolist() == [35]


def test_unseen_terrains_are_compared_with_a_reassessment_on_familiar_ones(tmp_path: Path) -> None:
    folder = write_run(tmp_path, SMALL, [10.0, 5.0])
    write_generalization(folder, training=[8.0, 4.0], unseen=[6.0, 5.0])
    assert measures.kept_on_unseen(condition(folder)).tolist() == [0.75, 1.25]


def test_measures_of_the_inner_life(tmp_path: Path) -> None:
    folder = write_run(tmp_path, SMALL, [10.0, 5.0])
    write_inner_life(folder, 2, growth=3.0, period=2.0)
    found = condition(folder)
    assert measures.weight_growth(found) == pytest.approx([3, 3])
    assert measures.gait_period(found) == pytest.approx([2, 2], rel=0.02)
    assert measures.cycle_over_gait(found) == pytest.approx([1, 1], rel=0.02)
    assert (measures.bimodality(found) > 0.8).all()


def test_random_genomes_are_told_beside_what_is_claimed_of_champions(tmp_path: Path) -> None:
    config = replace(SMALL, sensors="high")
    folder, other = (write_run(tmp_path, config, [5.0] * 10, name) for name in ("run", "other"))
    write_inner_life(folder, 10, growth=4.0)
    write_inner_life(other, 10, growth=3.0)
    (folder / "random_genomes.json").write_bytes((other / "inner_life.json").read_bytes())
    judged = {claim.number: finding for claim, finding in judge(gather([folder]))}
    assert judged["11"].measured[0].startswith("biped-4x3 high: median 4 of 10 runs")
    assert judged["11"].measured[1] == "biped-4x3 high: random genomes, median 3 of 10"


def write_paper(root: Path, runs: int) -> None:
    """Conditions as the paper found them."""
    rng = np.random.default_rng(0)
    for shape, sensors in BODIES:
        body = replace(SMALL, shape=shape, sensors=sensors, runs=runs)
        broken = replace(body, damage="half")
        is_biped = shape == "biped-4x3"
        full = 8.5 if is_biped else 4.0
        mlp = {"low": 0.1 if is_biped else 0.4, "medium": 0.6 if is_biped else 0.9}.get(
            sensors, 0.7 if is_biped else 0.9
        )
        for config, speed in (
            (body, full),
            (replace(body, controller="mlp"), full * mlp),
            (broken, full),
            (replace(broken, controller="mlp"), full * min(mlp, 0.6)),
            *((replace(body, sharing=s), 0.05) for s in ("single", "grouped", "postsynaptic")),
            (replace(body, sharing="presynaptic"), 0.6 * full),
            (replace(body, eta="evolved"), full),
            (replace(body, init="uniform"), full),
            (replace(body, normalize="l2"), full),
            (replace(body, normalize="minmax"), full),
        ):
            speeds = speed * rng.uniform(0.97, 1.03, runs)
            folder = write_run(root, config, speeds.tolist())
            write_evaluation(folder, config, speeds[:, None] * [[0.9, 1.0, 0.95]])
            write_generalization(folder, speeds.tolist(), (0.95 * speeds).tolist())
            normalized = [replace(body, normalize=how) for how in ("l2", "minmax")]
            if sensors == "high" and config in (body, *normalized):
                plateau = speeds * (0.9 if config == body else 0.0)
                write_freezing(folder, plateau[:, None] * (np.arange(30) > 3))
                write_paired(folder, speeds.tolist(), plateau.tolist())
                write_inner_life(folder, runs, period=1.5 if is_biped else 2.0)


def test_results_like_the_papers_support_its_claims(tmp_path: Path) -> None:
    write_paper(tmp_path, 10)
    judged = judge(gather(find_runs([tmp_path])))
    assert [claim.says for claim, finding in judged if finding.verdict != "supported"] == []


def test_three_runs_decide_nothing(tmp_path: Path) -> None:
    root, out = tmp_path / "runs", tmp_path
    write_paper(root, 3)
    text = report(find_runs([root]), out).read_text(encoding="utf-8")
    assert "3 run(s) of each; 10 generations" in text
    assert f"0 supported, 0 contradicted, {len(CLAIMS)} open." in text
    assert text.count("| **open** |") == len(CLAIMS)
    assert "fixed on 2026-11-25" in text
    assert "biped-4x3 low: Hebbian 8" in text


def test_every_claim_tells_where_its_evidence_comes_from() -> None:
    assert list(EVIDENCE) == [claim.number for claim in CLAIMS]
    drawn_for_other_variants = {"normalized_freezing", "minmax_freezing"}
    for number, evidence in EVIDENCE.items():
        study = STUDIES[evidence.study]
        names = [each.name for each in study.conditions(Scale())]
        assert evidence.shown in names, number
        assert set(evidence.figures) <= FIGURES.keys() | drawn_for_other_variants, number


def test_a_claim_has_a_page_with_its_commands_and_figures(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "runs", SMALL, [3.0])
    (tmp_path / "effectiveness.png").write_bytes(b"drawn")
    text = report([folder], tmp_path).read_text(encoding="utf-8")
    page = text.split("## 1. ")[1].split("## 2. ")[0]
    assert "`hebbtorch campaign effectiveness --out ROOT`" in page
    assert "`hebbtorch render ROOT/conditions/biped-4x3-low-hebbian`" in page
    assert "![effectiveness](effectiveness.png)" in page
    assert "![profiles]" not in page  # was not drawn
    assert text.count("\n## ") == 1 + len(CLAIMS)  # the rules, and a page for each


def test_the_report_says_what_was_not_measured(tmp_path: Path) -> None:
    write_run(tmp_path, SMALL, [3.0])
    for claim, finding in judge(gather(find_runs([tmp_path]))):
        assert finding.verdict == "open", claim.says
        assert "not measured: everywhere" in finding.reason or "biped-4x3 medium" in finding.reason
