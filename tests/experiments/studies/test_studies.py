"""The studies: conditions of the paper, and figures and analyses that exist."""

from pathlib import Path

import pytest

from experiments.analysis.registry import __all__ as analyses
from experiments.campaign.grid import (
    QUICK,
    Grid,
    Scale,
)
from experiments.campaign.options import CampaignOptions
from experiments.campaign.study import Study
from experiments.config import EvolveConfig
from experiments.report.figures import FIGURES
from experiments.studies.registry import GROUPS, STUDIES, find_studies


def names(study: str) -> list[str]:
    return [each.name for each in STUDIES[study].conditions(Scale())]


BODIES = [f"{s}-{a}" for s in ("biped-4x3", "worm-7x1") for a in ("low", "medium", "high")]


HIGH = [body for body in BODIES if body.endswith("high")]


NORMALIZED = ("hebbian", "hebbian-normalized", "hebbian-normalized-minmax")


def each_of(bodies: list[str], *suffixes: str) -> set[str]:
    return {f"{body}-{suffix}" for body in bodies for suffix in suffixes}


@pytest.mark.parametrize(
    ("study", "expected"),
    [
        ("effectiveness", each_of(BODIES, "hebbian", "mlp")),
        ("generalization", each_of(BODIES, "hebbian", "mlp")),
        ("damage", each_of(BODIES, "hebbian-damage-half", "mlp-damage-half")),
        ("true_learning", each_of(HIGH, "hebbian")),
        ("weight_dynamics", each_of(HIGH, *NORMALIZED)),
        ("normalization", each_of(HIGH, *NORMALIZED)),
        ("learning_rate", each_of(BODIES, "hebbian", "hebbian-eta-evolved")),
        (
            "rule_sharing",
            each_of(
                BODIES,
                "hebbian",
                "hebbian-single",
                "hebbian-grouped",
                "hebbian-postsynaptic",
                "hebbian-presynaptic",
            ),
        ),
        ("initialization", each_of(BODIES, "hebbian", "hebbian-init-uniform")),
        (
            "rule_terms",
            each_of(HIGH, "hebbian", *(f"hebbian-without-{term}" for term in "ABCD")),
        ),
        ("pruning", each_of(HIGH, "hebbian")),
        ("validation_matrix", each_of(BODIES, "hebbian", "mlp")),
    ],
)
def test_studies_have_the_conditions_of_the_paper(study: str, expected: set[str]) -> None:
    assert len(names(study)) == len(expected)
    assert set(names(study)) == expected


def test_studies_share_conditions() -> None:
    def union(group: str) -> dict[str, EvolveConfig]:
        found: dict[str, EvolveConfig] = {}
        for study in find_studies([group]):
            for each in study.conditions(Scale()):
                assert found.setdefault(each.name, each.config) == each.config
        return found

    # 12 plain, 12 damaged, 4 normalized, 6 with eta evolved, 24 sharing rules, 6 of random weights
    assert len(union("paper")) == 12 + 12 + 4 + 6 + 24 + 6
    # 40 static networks, 16 plastic ones at four control intervals, and 4 of the paper's code
    assert len(union("controls")) == 40 + 16 + 4
    # ... of which 8 are the plain ones; 8 without a term, 12 with genes of neurons, 8 attractors
    assert len(union("all")) == 64 + 60 - 8 + 8 + 12 + 8
    for config in union("all").values():
        assert (config.runs, config.generations, config.population) == (10, 500, 40)
        assert (config.duration, config.terrain, config.sigma) == (60.0, "hilly-3-30", 0.35)


def test_studies_are_what_their_scripts_are_called() -> None:
    assert [study.name for study in STUDIES.values()] == list(STUDIES)
    folder = Path(find_studies.__code__.co_filename).parent
    scripts = {path.stem for path in folder.glob("*.py")} - {"__init__", "bodies", "registry"}
    assert scripts == set(STUDIES)
    assert set(GROUPS["all"]) == scripts


def test_what_studies_make_of_their_runs_is_there() -> None:
    for study in STUDIES.values():
        assert set(study.analyses) <= set(analyses)
        assert set(study.figures) <= set(FIGURES)
    drawn = {figure for study in STUDIES.values() for figure in study.figures}
    assert drawn == set(FIGURES)


def test_studies_are_found_once_and_in_order() -> None:
    found = find_studies(["damage", "paper", "damage"])
    assert [study.name for study in found][:3] == ["damage", "effectiveness", "generalization"]
    assert len(found) == len(GROUPS["paper"])
    with pytest.raises(ValueError, match="study: expected some of effectiveness, .* got 'dmg'"):
        find_studies(["dmg"])


def test_a_condition_in_two_grids_of_a_study_is_one() -> None:
    low = Grid(axes={"sensors": ("low",)})
    study = Study("twice", "?", (low, Grid(axes={"sensors": ("low", "high")})))
    assert [each.name for each in study.conditions(QUICK)] == [
        "biped-4x3-low-hebbian",
        "biped-4x3-high-hebbian",
    ]


def test_quick_is_a_scale_of_its_own(tmp_path: Path) -> None:
    quick = CampaignOptions(out=tmp_path, scale=Scale(seed=3), quick=True).chosen_scale()
    assert quick == Scale(runs=2, generations=2, population=8, duration=2.0, seed=3)
    with pytest.raises(ValueError, match="quick: expected no --runs"):
        CampaignOptions(out=tmp_path, scale=Scale(runs=3), quick=True).chosen_scale()
    with pytest.raises(ValueError, match="generations: expected an integer >= 1, got 0"):
        CampaignOptions(out=tmp_path, scale=Scale(generations=0)).chosen_scale()
