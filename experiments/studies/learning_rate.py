"""Learning rates that evolve with the rules (paper, Sec. IV-D)."""

from experiments.campaign.grid import Grid
from experiments.campaign.script import main
from experiments.campaign.study import Study
from experiments.studies.bodies import ALL_BODIES

__all__ = ["STUDY"]

STUDY = Study(
    name="learning_rate",
    question="Does it help to evolve the learning rate of every rule?",
    grids=(Grid(axes={**ALL_BODIES, "eta": (0.01, "evolved")}),),
    figures=("learning_rate",),
)

if __name__ == "__main__":
    main(STUDY)
