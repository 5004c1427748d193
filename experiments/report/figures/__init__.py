"""The paper's figures, each drawn from the folders of finished runs, with its table.

A figure is a function of run folders and of a folder for its files, and returns what it wrote:
pictures as .png and .pdf, the table as .csv and .md. Folders that do not belong to a figure are
passed over; where there is nothing to draw, it returns nothing.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from experiments.report.figures.beyond import pruning, validation_matrix
from experiments.report.figures.controls import (
    attractors,
    control_interval,
    controls,
    neuron_rules,
)
from experiments.report.figures.freezing import normalized_freezing, true_learning
from experiments.report.figures.gaits import gaits
from experiments.report.figures.innateness import innateness
from experiments.report.figures.overview import profiles, takeoff
from experiments.report.figures.performance import (
    damage,
    damage_evolution,
    effectiveness,
    evolution,
    generalization,
)
from experiments.report.figures.recordings import activations, weight_distributions
from experiments.report.figures.recovery import recovery, unforeseen
from experiments.report.figures.settings import settings
from experiments.report.figures.variants import (
    initialization,
    learning_rate,
    normalization,
    rule_sharing,
    rule_terms,
)

__all__ = ["FIGURES", "Figure"]

Figure = Callable[[Sequence[Path], Path], list[Path]]

FIGURES: Mapping[str, Figure] = {
    figure.__name__: figure
    for figure in (
        effectiveness,
        evolution,
        takeoff,
        profiles,
        generalization,
        settings,
        damage,
        damage_evolution,
        recovery,
        unforeseen,
        true_learning,
        innateness,
        weight_distributions,
        activations,
        normalization,
        normalized_freezing,
        learning_rate,
        rule_sharing,
        initialization,
        controls,
        control_interval,
        gaits,
        neuron_rules,
        attractors,
        rule_terms,
        pruning,
        validation_matrix,
    )
}
