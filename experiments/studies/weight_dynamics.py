"""Weights and activations in the course of an episode (paper, Fig. 7, 9)."""

from experiments.campaign.grid import Grid
from experiments.campaign.script import main
from experiments.campaign.study import Study
from experiments.studies.bodies import HIGH_BODIES

__all__ = ["STUDY"]

STUDY = Study(
    name="weight_dynamics",
    question="What do plasticity and normalisation make of weights and activations?",
    grids=(Grid(axes={**HIGH_BODIES, "normalize": (None, "l2", "minmax")}),),
    analyses=("recorded", "random_genomes"),
    figures=("weight_distributions", "activations"),
)

if __name__ == "__main__":
    main(STUDY)
