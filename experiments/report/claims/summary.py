"""REPORT.md: what finished runs say about the paper's claims."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from experiments.io.atomic import write_atomically
from experiments.report import statistics, tables
from experiments.report.claims import verdicts
from experiments.report.claims.evidence import EVIDENCE
from experiments.report.claims.finding import Finding, Verdict
from experiments.report.claims.measures import Results
from experiments.report.claims.paper import CLAIMS, Claim
from experiments.report.conditions import READABLE_CAPTION, readable_rows
from experiments.report.finished_runs import FinishedRuns, gather

__all__ = ["judge", "write_summary"]

_FILE = "REPORT.md"
_ORDER: Sequence[Verdict] = ("supported", "contradicted", "open")


def write_summary(run_folders: Sequence[Path], out: Path) -> Path:
    """Judge every claim by finished runs, and write REPORT.md.

    Args:
        run_folders: The folders of finished runs.
        out: an existing folder.

    Returns:
        The file.

    Raises:
        ValueError: a run cannot be read, or the runs are of different scales.
    """
    conditions = gather(run_folders)
    judged = judge(conditions)
    counts = Counter(finding.verdict for _, finding in judged)
    rows = [
        {
            "": claim.number,
            "claim": claim.says,
            "in the paper": claim.source,
            "verdict": f"**{finding.verdict}**",
            "tendency": finding.tendency,
            "why": finding.reason,
        }
        for claim, finding in judged
    ]
    parts = [
        "# The paper's claims, by the runs so far",
        _scale(conditions),
        ", ".join(f"{counts[verdict]} {verdict}" for verdict in _ORDER) + ".",
        tables.markdown(rows),
        "## Every condition",
        f"{READABLE_CAPTION} With every digit: [conditions.csv](conditions.csv).",
        tables.markdown(readable_rows(conditions)),
        "## How verdicts are reached",
        (verdicts.__doc__ or "").strip(),
        f"The margin is {100 * verdicts.MARGIN:.0f} % of the second's median. {_limits()} A12 is "
        "the probability that a run of the first named is higher (0.5: no effect).",
        *(_page(*each, out) for each in judged),
    ]
    write_atomically(out / _FILE, ("\n\n".join(parts) + "\n").encode())
    return out / _FILE


def judge(conditions: Sequence[FinishedRuns]) -> list[tuple[Claim, Finding]]:
    """Every claim of the paper with its verdict, by the runs of some conditions."""
    results = Results(conditions)
    return [(claim, claim.judge(results)) for claim in CLAIMS]


def _scale(conditions: Sequence[FinishedRuns]) -> str:
    if not conditions:
        return "No finished runs."
    config = conditions[0].config
    runs = sorted({len(each.fitness) for each in conditions})
    of_each = str(runs[0]) if len(runs) == 1 else f"{runs[0]} to {runs[-1]}"
    return (
        f"{len(conditions)} conditions, {of_each} run(s) of each; {config.generations} "
        f"generations, population {config.population}, episodes of {config.duration:g} s. "
        "The paper's scale is 10 runs of 500 generations."
    )


def _limits() -> str:
    least = ", ".join(f"{statistics.least_p(n, n):.2g} for {n}" for n in (3, 4, 5, 10))
    return (
        "However different two samples are, so many runs against as many cannot bring the "
        f"two-sided Mann-Whitney p below: {least}; before the correction for several places."
    )


def _page(claim: Claim, finding: Finding, out: Path) -> str:
    """All there is about one claim."""
    evidence = EVIDENCE[claim.number]
    drawn = [name for name in evidence.figures if (out / f"{name}.png").is_file()]
    runs = f"`hebbtorch campaign {evidence.study} --out ROOT`"
    film = f"`hebbtorch render ROOT/conditions/{evidence.shown}`"
    lines = [
        f"## {claim.number}. {claim.says}",
        "",
        f"- **Verdict**: {finding.verdict}; {finding.reason}",
        f"- **In the paper**: {claim.source}",
        f"- **Measured, and what would support it**: {claim.test}",
        f"- **Commands**: {runs}, then `hebbtorch figures ROOT`; film: {film}",
        f"- **Tables**: {', '.join(f'[{name}]({name}.csv)' for name in drawn) or 'none yet'}",
        "- **Tests**: of the rules and measures, `tests/experiments/report/test_claims.py`",
        "",
        *([f"- {line}" for line in finding.measured] or ["- nothing measured"]),
        *(f"\n![{name}]({name}.png)" for name in drawn),
    ]
    return "\n".join(lines)
