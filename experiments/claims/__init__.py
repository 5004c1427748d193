"""The paper's claims, judged by finished runs.

verdicts (rules) -> measures (numbers of runs) -> paper (the claims) -> report
"""

from experiments.claims.paper import CLAIMS, Claim
from experiments.claims.report import judge, report

__all__ = ["CLAIMS", "Claim", "judge", "report"]
