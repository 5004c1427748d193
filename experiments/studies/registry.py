"""All studies, in the order of the paper, and what `hebbtorch campaign` calls several of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from experiments.campaign.study import Study, read_study
from experiments.studies import (
    attractors,
    control_interval,
    damage,
    effectiveness,
    generalization,
    initialization,
    learning_rate,
    neuron_rules,
    normalization,
    papers_code,
    pruning,
    rule_sharing,
    rule_terms,
    static_gain,
    true_learning,
    validation_matrix,
    weight_dynamics,
)

__all__ = ["GROUPS", "STUDIES", "find_studies"]

_PAPER = (
    effectiveness,
    generalization,
    damage,
    true_learning,
    weight_dynamics,
    normalization,
    learning_rate,
    rule_sharing,
    initialization,
)
_CONTROLS = (static_gain, control_interval, papers_code)
_BEYOND = (neuron_rules, attractors, rule_terms, pruning, validation_matrix)

STUDIES: Mapping[str, Study] = {
    script.STUDY.name: script.STUDY for script in (*_PAPER, *_CONTROLS, *_BEYOND)
}
GROUPS: Mapping[str, tuple[str, ...]] = {
    "paper": tuple(script.STUDY.name for script in _PAPER),
    "controls": tuple(script.STUDY.name for script in _CONTROLS),
    "all": tuple(STUDIES),
}


def find_studies(names: Iterable[str], grid: Path | None = None) -> list[Study]:
    """Studies by name, each once, in the order of their first mention.

    Args:
        names: The names of studies, or of groups of them.
        grid: file of one more, see `experiments.campaign.study.read_study`.

    Raises:
        ValueError: there is none of this name, or the file is wrong or called like one of these.
    """
    found: dict[str, Study] = {}
    for name in names:
        if name not in STUDIES and name not in GROUPS:
            raise ValueError(
                f"study: expected some of {', '.join((*STUDIES, *GROUPS))}, got {name!r}"
            )
        found.update({each: STUDIES[each] for each in GROUPS.get(name, (name,))})
    if grid is not None:
        own = read_study(grid)
        if own.name in STUDIES or own.name in GROUPS:
            raise ValueError(
                f"grid: expected a file with a name of its own, got {grid.name!r}, the name of a "
                "study that is there already; rename it"
            )
        found[own.name] = own
    return list(found.values())
