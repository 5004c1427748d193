"""The paper's claims, judged by finished runs.

finding -> verdicts (rules) -> measures (numbers of runs) -> judges -> paper (the claims) -> report
"""

from experiments.report.claims.paper import CLAIMS, Claim
from experiments.report.claims.summary import judge, write_summary

__all__ = ["CLAIMS", "Claim", "judge", "write_summary"]
