"""Means of activations, rarer updates and bounded weights, step by step; not in the paper.

Source of the ladder: arXiv 2603.22512. With its last step the weights come to rest at a fixed point
and the gait should survive when updates stop.
"""

from experiments.campaign.grid import Grid
from experiments.campaign.script import main
from experiments.campaign.study import Study
from experiments.config import EvolveConfig
from experiments.studies.bodies import HIGH_BODIES

__all__ = ["STUDY"]

STUDY = Study(
    name="attractors",
    question="When do the weights come to rest, so that a gait survives the end of learning?",
    grids=(
        Grid(axes=HIGH_BODIES),
        Grid(
            base=EvolveConfig(normalize="max"),
            axes={**HIGH_BODIES, "average": (1, 10), "every": (1, 4)},
        ),
    ),
    analyses=("frozen", "paired_speeds", "recorded", "random_genomes", "settled"),
    figures=("attractors", "takeoff"),
)

if __name__ == "__main__":
    main(STUDY)
