"""Champions on terrains that their evolution never met (paper, Fig. 3)."""

from experiments.campaign.grid import Grid
from experiments.campaign.script import main
from experiments.campaign.study import Study
from experiments.studies.bodies import ALL_BODIES

__all__ = ["STUDY"]

STUDY = Study(
    name="generalization",
    question="Do the champions move as well on terrains that they never met?",
    grids=(Grid(axes={**ALL_BODIES, "controller": ("hebbian", "mlp")}),),
    analyses=("unseen_terrains", "generalized", "recovered"),
    figures=("generalization", "settings", "unforeseen"),
)

if __name__ == "__main__":
    main(STUDY)
