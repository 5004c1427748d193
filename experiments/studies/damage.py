"""Voxels that break at half of the episode (paper, Fig. 5)."""

from experiments.campaign.grid import Grid
from experiments.campaign.script import main
from experiments.campaign.study import Study
from experiments.config import EvolveConfig
from experiments.studies.bodies import ALL_BODIES

__all__ = ["STUDY"]

STUDY = Study(
    name="damage",
    question="Does a controller that learns recover better when voxels break?",
    grids=(
        Grid(
            base=EvolveConfig(damage="half"),
            axes={**ALL_BODIES, "controller": ("hebbian", "mlp")},
        ),
    ),
    analyses=("unseen_terrains", "recovered"),
    figures=("damage", "damage_evolution", "recovery"),
)

if __name__ == "__main__":
    main(STUDY)
