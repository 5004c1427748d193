"""Controllers that act and learn less often than every 1/60 s; not in the paper."""

from experiments.campaign.grid import Grid
from experiments.campaign.script import main
from experiments.campaign.study import Study
from experiments.studies.bodies import LOW_AND_HIGH

__all__ = ["STUDY"]

STUDY = Study(
    name="control_interval",
    question="Are the gaits vibrations, which a slower controller could not sustain?",
    grids=(Grid(axes={**LOW_AND_HIGH, "control_interval": (1, 2, 4, 12)}),),
    analyses=("unseen_terrains", "gaits_watched", "recorded", "random_genomes"),
    figures=("control_interval", "takeoff", "gaits", "activations"),
)

if __name__ == "__main__":
    main(STUDY)
