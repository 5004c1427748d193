"""Synapses that share rules (paper, Sec. IV-D)."""

from experiments.campaign.grid import Grid
from experiments.campaign.script import main
from experiments.campaign.study import Study
from experiments.studies.bodies import ALL_BODIES

__all__ = ["STUDY"]

STUDY = Study(
    name="rule_sharing",
    question="How many rules does it take: one, a few, or one for every synapse?",
    grids=(
        Grid(
            axes={
                **ALL_BODIES,
                # The paper calls the grouped model "sensors".
                "sharing": ("full", "single", "grouped", "postsynaptic", "presynaptic"),
            }
        ),
    ),
    figures=("rule_sharing",),
)

if __name__ == "__main__":
    main(STUDY)
