"""Weights that cannot diverge, and their freezing (paper, Fig. 8, 10).

"l2" is what the paper's text says, "minmax" what its code does.
"""

from experiments.campaign.grid import Grid
from experiments.campaign.script import main
from experiments.campaign.study import Study
from experiments.studies.bodies import HIGH_BODIES

__all__ = ["STUDY"]

STUDY = Study(
    name="normalization",
    question="Does it take diverging weights to move fast, and to keep what was learned?",
    grids=(Grid(axes={**HIGH_BODIES, "normalize": (None, "l2", "minmax")}),),
    analyses=("frozen", "paired_speeds"),
    figures=("normalization", "normalized_freezing"),
)

if __name__ == "__main__":
    main(STUDY)
