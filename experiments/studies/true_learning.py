"""Weights frozen at every second of an episode (paper, Fig. 6)."""

from experiments.campaign.grid import Grid
from experiments.campaign.script import main
from experiments.campaign.study import Study
from experiments.studies.bodies import HIGH_BODIES

__all__ = ["STUDY"]

STUDY = Study(
    name="true_learning",
    question="Does a robot still walk when its weights are frozen, and from when on?",
    grids=(Grid(axes=HIGH_BODIES),),
    analyses=("frozen", "paired_speeds", "endured"),
    figures=("true_learning", "innateness"),
)

if __name__ == "__main__":
    main(STUDY)
