"""Diverged synapses cut out: the paper's lottery-ticket speculation (Sec. IV-C)."""

from experiments.campaign.grid import Grid
from experiments.campaign.script import main
from experiments.campaign.study import Study
from experiments.studies.bodies import HIGH_BODIES

__all__ = ["STUDY"]

STUDY = Study(
    name="pruning",
    question="Do champions still walk without the synapses whose weights diverged?",
    grids=(Grid(axes=HIGH_BODIES),),
    analyses=("pruned",),
    figures=("pruning",),
)

if __name__ == "__main__":
    main(STUDY)
