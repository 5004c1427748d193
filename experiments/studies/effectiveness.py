"""Hebbian learning against a static network, at the end of evolution (paper, Fig. 2, 4)."""

from experiments.campaign.grid import Grid
from experiments.campaign.script import main
from experiments.campaign.study import Study
from experiments.studies.bodies import ALL_BODIES

__all__ = ["STUDY"]

STUDY = Study(
    name="effectiveness",
    question="Do evolved rules of learning move a robot faster than evolved weights?",
    grids=(Grid(axes={**ALL_BODIES, "controller": ("hebbian", "mlp")}),),
    figures=("effectiveness", "evolution", "takeoff", "profiles"),
)

if __name__ == "__main__":
    main(STUDY)
