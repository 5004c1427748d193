"""Variants of the Hebbian model against the full one: Fig. 8, Sec. IV-D, and what goes beyond."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from experiments.report.figures import boxes
from experiments.report.figures.performance import box
from experiments.report.finished_runs import FinishedRuns, gather

__all__ = [
    "FULL",
    "initialization",
    "learning_rate",
    "normalization",
    "rule_sharing",
    "rule_terms",
    "variants_of",
]

FULL = "Hebbian"
"""Label of the paper's main model."""

_ORDER = ("single", "grouped", "postsynaptic", "presynaptic")  # paper, Sec. IV-D
_CAPTION = (
    "Speed of each run's best individual at the end of evolution [m/s]; medians over runs with "
    "95 % bootstrap intervals. Every variant against the main model, the full one."
)


def normalization(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Fig. 8: with and without normalization of the weights."""
    return _figure(run_folders, out, "normalization", "normalize")


def learning_rate(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Learning rates that evolve along with the rules, and fixed ones (Sec. IV-D)."""
    return _figure(run_folders, out, "learning_rate", "eta")


def rule_sharing(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """One rule for several synapses (Sec. IV-D)."""
    return _figure(run_folders, out, "rule_sharing", "sharing")


def initialization(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Initial weights drawn from U(-1, 1) instead of zero (Sec. IV-D)."""
    return _figure(run_folders, out, "initialization", "init")


def rule_terms(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Rules without one of their terms A, B, C and D."""
    return _figure(run_folders, out, "rule_terms", "terms")


def variants_of(conditions: Sequence[FinishedRuns], option: str) -> list[FinishedRuns]:
    """The conditions in which one option alone differs from the main model, without damage."""
    return [
        each
        for each in conditions
        if set(each.variant) == {option} and each.config.damage == "none"
    ]


def _figure(run_folders: Sequence[Path], out: Path, name: str, option: str) -> list[Path]:
    conditions = gather(run_folders)
    found = variants_of(conditions, option)
    places = {each.where for each in found}
    full = [each for each in conditions if _is_full(each) and each.where in places]
    found = sorted(found, key=_place)
    drawn = [box(each, each.fitness) for each in (*full, *found)]
    return boxes.draw(drawn, out, name, FULL, _CAPTION)


def _is_full(condition: FinishedRuns) -> bool:
    config = condition.config
    return config.controller == "hebbian" and not condition.variant and config.damage == "none"


def _place(condition: FinishedRuns) -> tuple[int, str]:
    """Sorts the models of Sec. IV-D as they are there, and all else by name."""
    sharing = condition.config.sharing
    return (_ORDER.index(sharing) if sharing in _ORDER else len(_ORDER), condition.label)
