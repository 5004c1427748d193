"""Where the evidence for each claim comes from: study, figures with their tables, and a film."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

__all__ = ["EVIDENCE", "Evidence"]


@dataclass(frozen=True)
class Evidence:
    """What shows a claim.

    Attributes:
        study: that makes the runs, and analyses them.
        figures: names of figures, each of which has a table beside it.
        shown: a condition whose champion is worth watching.
    """

    study: str
    figures: tuple[str, ...]
    shown: str


_PLAIN = "biped-4x3-low-hebbian"
_HIGH = "biped-4x3-high-hebbian"
_EFFECTIVENESS = ("effectiveness", "profiles")
_INNER = ("weight_distributions",)

_BY_NORM = {
    "a": ("normalized", "normalized_freezing"),
    "b": ("normalized-minmax", "minmax_freezing"),
}
_NORMALIZED = {
    f"{number}{letter}": Evidence(
        study,
        (freezing,) if number == "15" else figures,
        f"worm-7x1-high-hebbian-{suffix}",
    )
    for letter, (suffix, freezing) in _BY_NORM.items()
    for number, study, figures in (
        ("14", "normalization", ("normalization",)),
        ("15", "normalization", ()),
        ("16", "weight_dynamics", ("activations",)),
        ("17", "weight_dynamics", ("activations",)),
    )
}

EVIDENCE: Mapping[str, Evidence] = {
    "1": Evidence("effectiveness", _EFFECTIVENESS, _PLAIN),
    "2": Evidence("effectiveness", (*_EFFECTIVENESS, "takeoff"), _PLAIN),
    "3": Evidence("effectiveness", _EFFECTIVENESS, _PLAIN),
    "4": Evidence("effectiveness", ("evolution", "takeoff"), _PLAIN),
    "5": Evidence("generalization", ("generalization",), _HIGH),
    "6": Evidence("generalization", ("generalization", "settings"), _HIGH),
    "7": Evidence("damage", ("damage", "recovery", "unforeseen"), f"{_HIGH}-damage-half"),
    "8": Evidence("damage", ("damage", "damage_evolution"), f"{_HIGH}-damage-half"),
    "9": Evidence("true_learning", ("true_learning", "innateness"), _HIGH),
    "10": Evidence("true_learning", ("true_learning",), _HIGH),
    "11": Evidence("weight_dynamics", _INNER, _HIGH),
    "12": Evidence("weight_dynamics", _INNER, _HIGH),
    "13": Evidence("weight_dynamics", ("activations",), _HIGH),
    **_NORMALIZED,
    "18": Evidence("learning_rate", ("learning_rate",), f"{_PLAIN}-eta-evolved"),
    "19": Evidence("rule_sharing", ("rule_sharing",), f"{_PLAIN}-single"),
    "20": Evidence("rule_sharing", ("rule_sharing",), f"{_PLAIN}-presynaptic"),
    "21": Evidence("initialization", ("initialization",), f"{_PLAIN}-init-uniform"),
}
"""By the number of the claim."""
