"""The paper's claims, judged by finished runs.

finding -> verdicts (rules) -> measures (numbers of runs) -> judges -> paper (the claims) -> report
"""

from experiments.report.claims.paper import CLAIMS, Claim
from experiments.report.claims.report import judge, report

__all__ = ["CLAIMS", "Claim", "judge", "report"]
