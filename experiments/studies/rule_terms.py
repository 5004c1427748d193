"""The share of each term of the rule; not in the paper."""

from experiments.campaign.grid import Grid
from experiments.campaign.script import main
from experiments.campaign.study import Study
from experiments.studies.bodies import HIGH_BODIES

__all__ = ["STUDY"]

STUDY = Study(
    name="rule_terms",
    question="Which of the terms A, B, C and D does learning need?",
    grids=(Grid(axes={**HIGH_BODIES, "terms": ("ABCD", "BCD", "ACD", "ABD", "ABC")}),),
    figures=("rule_terms",),
)

if __name__ == "__main__":
    main(STUDY)
