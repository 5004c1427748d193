"""Static networks with larger weights, biases or memory, fast and slow control; not in the paper.

Growing weights act as a growing gain. If a static network whose genes are multiplied by a gain does
as well, what the plastic one has over the plain baseline is its weights' size, not its plasticity.
"""

from experiments.campaign.grid import Grid
from experiments.campaign.script import main
from experiments.campaign.study import Study
from experiments.config import EvolveConfig
from experiments.studies.bodies import INTERVALS, LOW_AND_HIGH

__all__ = ["STUDY"]

_GAIN = 30.0

STUDY = Study(
    name="static_gain",
    question="Is it plasticity, or would larger static weights, biases or memory do as well?",
    grids=(
        Grid(
            base=EvolveConfig(controller="mlp"),
            axes={**LOW_AND_HIGH, "gain": (1.0, 10.0, _GAIN), **INTERVALS},
        ),
        Grid(
            base=EvolveConfig(controller="mlp", gain=_GAIN, bias=True),
            axes={**LOW_AND_HIGH, **INTERVALS},
        ),
        Grid(
            base=EvolveConfig(controller="rnn", gain=_GAIN),
            axes={**LOW_AND_HIGH, **INTERVALS},
        ),
        Grid(axes={**LOW_AND_HIGH, **INTERVALS}),
    ),
    analyses=("unseen_terrains", "gaits_watched"),
    figures=("controls", "takeoff", "gaits"),
)

if __name__ == "__main__":
    main(STUDY)
