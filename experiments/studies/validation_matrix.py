"""Champions on every kind of ground, whole and broken; not in the paper."""

from experiments.campaign.grid import Grid
from experiments.campaign.script import main
from experiments.campaign.study import Study
from experiments.studies.bodies import ALL_BODIES

__all__ = ["STUDY"]

STUDY = Study(
    name="validation_matrix",
    question="How far do the champions carry: other terrains, damage, other seeds?",
    grids=(Grid(axes={**ALL_BODIES, "controller": ("hebbian", "mlp")}),),
    analyses=("matrix",),
    figures=("validation_matrix",),
)

if __name__ == "__main__":
    main(STUDY)
