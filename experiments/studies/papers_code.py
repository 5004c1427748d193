"""The networks of the paper's own code, which differ from those of its text."""

from experiments.campaign.grid import Grid
from experiments.campaign.script import main
from experiments.campaign.study import Study
from experiments.config import EvolveConfig
from experiments.studies.bodies import SHAPES

__all__ = ["STUDY"]

_LOW = {"sensors": ("low",), "shape": SHAPES}

STUDY = Study(
    name="papers_code",
    question="How much of the difference is due to what the paper's code does otherwise?",
    grids=(
        Grid(axes={**_LOW, "controller": ("hebbian", "mlp")}),
        Grid(base=EvolveConfig(controller="mlp", input_activation="tanh", bias=True), axes=_LOW),
        Grid(base=EvolveConfig(exchange_bc=True, constant_last_input=True), axes=_LOW),
    ),
    analyses=("unseen_terrains",),
    figures=("controls", "takeoff"),
)

if __name__ == "__main__":
    main(STUDY)
