"""The commands on campaigns: campaign, figures, report, pack, unpack."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import tyro

from experiments.campaign.options import CampaignOptions
from experiments.cli.arguments import Root, Roots, RunOrRoot, Studies, one_thread

__all__ = ["COMMANDS"]


def campaign(
    studies: Studies,
    options: Annotated[CampaignOptions, tyro.conf.arg(name="")],
    grid: Path | None = None,
) -> None:
    """Run studies: every condition with all its seeds, then analyses and figures; resumable.

    For example:
        hebbtorch campaign effectiveness --runs 3 --generations 100 --out runs/look --dry-run
        hebbtorch campaign paper --out runs/paper

    Args:
        studies: Names of studies: those of experiments/studies, "paper" for all of the paper's,
            "all" for all there are.
        options: Where, how much and on what.
        grid: TOML file with a study of one's own: a table [base] with options of `evolve` and a
            table [axes] with the lists of values that others go through.
    """
    from experiments.campaign.launch import run_campaign
    from experiments.studies.registry import find_studies

    one_thread()
    sys.exit(run_campaign(find_studies(studies, grid), options))


def report(folder: RunOrRoot, seed: int = 0, out: Path | None = None) -> None:
    """Write one HTML page about a run or a campaign, to read or to send; it needs no network.

    A run's page shows its champion's episode to scrub, with weights, activations and speed at the
    same time; a campaign's the table of its conditions, their curves, figures and verdicts.

    For example:
        hebbtorch report runs/first
        hebbtorch report runs/paper --out paper.html

    Args:
        folder: Folder of a finished run or of a campaign, or a file that `record` wrote.
        seed: Decides terrain, sensor noise and damage of the episodes shown.
        out: HTML file; by default report.html in the folder.
    """
    from experiments.report.page.write import write_page

    one_thread()
    write_page(folder, out, seed)


def pack(root: Root, out: Path, seed: int = 0, digits: int | None = None) -> None:
    """Put a campaign into few files: champions, tables, checksums, figures and report.

    For example:
        hebbtorch pack runs/paper --out paper
        hebbtorch pack runs/paper --out paper --digits 7

    Args:
        root: Folder of a campaign, or any folder with finished runs below it.
        out: New folder for the files, or one that was packed before.
        seed: Decides the resampling behind the bootstrap intervals.
        digits: Significant digits of the numbers in its tables, for smaller files; all if not
            given. Champions and the table of runs keep all.
    """
    from experiments.report.bundle import pack as pack_runs
    from experiments.report.gallery import draw_all

    for path in pack_runs(root, out, digits):
        print(f"wrote {path}")
    _tell_what_is_missing(draw_all((out,), None, seed, all_formats=False))


def unpack(bundle: Root, out: Path) -> None:
    """Restore the folders of the runs of a packed campaign, to render, evaluate or freeze them.

    For example:
        hebbtorch unpack paper --out runs/paper

    Args:
        bundle: Folder that `pack` wrote.
        out: New folder for the runs.
    """
    from experiments.report.bundle import unpack as unpack_runs

    unpack_runs(bundle, out)
    print(f"wrote {out}")


def figures(roots: Roots, seed: int = 0, out: Path | None = None) -> None:
    """Draw the paper's figures from finished runs, with their statistics and a report.

    For example:
        hebbtorch figures runs/paper
        hebbtorch figures runs/a runs/b --out figures

    Args:
        roots: Folder of a campaign, packed or not, or any folders with finished runs below them; or
            files that `record` wrote, each of which gets a figure.
        seed: Decides the resampling behind the bootstrap intervals.
        out: Folder for the files; by default `figures` in the first folder.
    """
    from experiments.report.gallery import draw_all

    _tell_what_is_missing(draw_all(roots, out, seed))


def _tell_what_is_missing(figures: Sequence[str]) -> None:
    """Name, for each figure that was not drawn, the study whose runs it needs."""
    from experiments.studies.registry import STUDIES

    for figure in figures:
        study = next(study.name for study in STUDIES.values() if figure in study.figures)
        print(f"not drawn: {figure}; `hebbtorch campaign {study} --out ROOT` makes what it needs")


COMMANDS = (campaign, report, pack, unpack, figures)
