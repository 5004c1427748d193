"""Rules whose genes belong to neurons instead of synapses; not in the paper.

Source of the rule: arXiv 2403.12076, "neuron-centric Hebbian learning".
"""

from experiments.campaign.grid import Grid
from experiments.campaign.script import main
from experiments.campaign.study import Study
from experiments.config import EvolveConfig
from experiments.studies.bodies import ALL_BODIES

__all__ = ["STUDY"]

STUDY = Study(
    name="neuron_rules",
    question="Do genes of neurons do as well as many times more genes of synapses?",
    grids=(
        Grid(axes={**ALL_BODIES, "eta": (0.01, "evolved")}),
        Grid(base=EvolveConfig(sharing="neuron"), axes={**ALL_BODIES, "eta": (0.01, "evolved")}),
    ),
    analyses=("unseen_terrains",),
    figures=("neuron_rules", "takeoff"),
)

if __name__ == "__main__":
    main(STUDY)
