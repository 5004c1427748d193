"""The paper's claims: what they measure of runs, and the report on them."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from experiments.campaign.grid import Scale
from experiments.config import EvolveConfig
from experiments.report.claims import CLAIMS, judge, measures
from experiments.report.claims.evidence import EVIDENCE
from experiments.report.claims.summary import write_summary
from experiments.report.figures import FIGURES
from experiments.report.finished_runs import FinishedRuns, find_runs, gather
from experiments.studies.registry import STUDIES
from tests.experiments.finished_runs import (
    write_evaluation,
    write_freezing,
    write_generalization,
    write_paired,
    write_recording,
    write_run,
)

NAN = math.nan
BODIES = [(shape, s) for shape in ("biped-4x3", "worm-7x1") for s in ("low", "medium", "high")]
SMALL = EvolveConfig(generations=10, population=8)


def condition(folder: Path) -> FinishedRuns:
    (found,) = gather([folder])
    return found


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


def test_measures_of_a_recording(tmp_path: Path) -> None:
    folder = write_run(tmp_path, SMALL, [10.0, 5.0])
    write_recording(folder, 2, growth=3.0, period=2.0)
    found = condition(folder)
    assert measures.weight_growth(found) == pytest.approx([3, 3])
    assert measures.gait_period(found) == pytest.approx([2, 2], rel=0.02)
    assert measures.cycle_over_gait(found) == pytest.approx([1, 1], rel=0.02)
    assert (measures.bimodality(found) > 0.8).all()


def test_random_genomes_are_told_beside_what_is_claimed_of_champions(tmp_path: Path) -> None:
    config = replace(SMALL, sensors="high")
    folder, other = (write_run(tmp_path, config, [5.0] * 10, name) for name in ("run", "other"))
    write_recording(folder, 10, growth=4.0)
    write_recording(other, 10, growth=3.0)
    (folder / "random_genomes.json").write_bytes((other / "recording.json").read_bytes())
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
                write_recording(folder, runs, period=1.5 if is_biped else 2.0)


def test_results_like_the_papers_support_its_claims(tmp_path: Path) -> None:
    write_paper(tmp_path, 10)
    judged = judge(gather(find_runs([tmp_path])))
    assert [claim.says for claim, finding in judged if finding.verdict != "supported"] == []


def test_three_runs_decide_nothing(tmp_path: Path) -> None:
    root, out = tmp_path / "runs", tmp_path
    write_paper(root, 3)
    text = write_summary(find_runs([root]), out).read_text(encoding="utf-8")
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
    text = write_summary([folder], tmp_path).read_text(encoding="utf-8")
    page = text.split("## 1. ")[1].split("## 2. ")[0]
    assert "`hebbtorch campaign effectiveness --out ROOT`" in page
    assert "`hebbtorch render ROOT/conditions/biped-4x3-low-hebbian`" in page
    assert "![effectiveness](effectiveness.png)" in page
    assert "![profiles]" not in page  # was not drawn
    assert text.count("\n## ") == 2 + len(CLAIMS)  # the conditions, the rules, and a page for each


def test_the_report_says_what_was_not_measured(tmp_path: Path) -> None:
    write_run(tmp_path, SMALL, [3.0])
    for claim, finding in judge(gather(find_runs([tmp_path]))):
        assert finding.verdict == "open", claim.says
        assert "not measured: everywhere" in finding.reason or "biped-4x3 medium" in finding.reason
