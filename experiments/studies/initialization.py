"""Initial weights (paper, Sec. IV-D)."""

from experiments.campaign.grid import Grid
from experiments.campaign.script import main
from experiments.campaign.study import Study
from experiments.studies.bodies import ALL_BODIES

__all__ = ["STUDY"]

STUDY = Study(
    name="initialization",
    question="Does it matter whether weights are zero or random at the start?",
    grids=(Grid(axes={**ALL_BODIES, "init": ("zeros", "uniform")}),),
    figures=("initialization",),
)

if __name__ == "__main__":
    main(STUDY)
