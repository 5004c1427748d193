"""The command line, `hebbtorch <command>`.

Commands import what they need when they run, so that --help answers at once.
"""

from __future__ import annotations

import contextlib
import functools
import io
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro
from tyro.extras import SubcommandApp

from experiments.analysis.film_options import FilmOptions
from experiments.campaign.options import CampaignOptions
from experiments.config import EvolveConfig

__all__ = ["main"]

_SYSTEM_ERROR, _USAGE_ERROR, _INTERRUPTED = 1, 2, 130

app = SubcommandApp()


def _command(function: Callable[..., None]) -> Callable[..., None]:
    """Registers a command: the arguments are read first, and it runs when all of them are."""

    @functools.wraps(function)
    def read(*args: Any, **kwargs: Any) -> Any:
        return functools.partial(function, *args, **kwargs)

    app.command(read)
    return function


_Folder = Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
_Roots = Annotated[tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="ROOT [ROOT ...]")]
_Root = Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="ROOT")]
_Studies = Annotated[
    tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="[STUDY [STUDY ...]]")
]


@_command
def evolve(
    config: Annotated[EvolveConfig, tyro.conf.arg(name="")],
    out: Path | None = None,
    resume: Path | None = None,
) -> None:
    """Evolve controllers; one or several runs.

    Args:
        config: the options.
        out: New folder for the run; by default, a free name in runs/.
        resume: Folder of a run to go on with, exactly; its options are those it has.
    """
    from experiments.evolution import evolve as evolution

    _one_thread()
    if resume is None:
        evolution.evolve(config, out or _free_folder(config))
        return
    if out is not None or config != EvolveConfig():
        raise ValueError(
            "resume: expected no other option, since a run goes on with those it has; "
            f"got some: use --resume {resume} alone, or start anew with --out"
        )
    evolution.resume(resume)


@_command
def evaluate(
    folder: _Folder,
    terrains: int = 10,
    terrain: str = "same",
    damage: Literal["same", "none", "half"] = "same",
    seed: int = 0,
    out: Path | None = None,
) -> None:
    """Re-assess the champions of a run on terrains that its evolution never met.

    Args:
        folder: Folder of the run.
        terrains: Number of terrains.
        terrain: Kind of terrain, such as hilly-3-30 or flat, or the same as in the evolution.
        damage: As in `evolve`, or the same as in the evolution.
        seed: Decides sensor noise and damage.
        out: CSV file to write; by default one in the run's folder, named after the conditions.
    """
    from experiments.analysis.unseen import report

    _one_thread()
    report(
        folder,
        terrains,
        None if terrain == "same" else terrain,
        None if damage == "same" else damage,
        seed,
        out,
    )


@_command
def freeze(
    folder: _Folder,
    terrains: int = 3,
    seed: int = 0,
    out: Path | None = None,
) -> None:
    """Freeze the champions' weights at each second of a life, and see how they walk from then on.

    Args:
        folder: Folder of the run.
        terrains: Number of unseen terrains on which each snapshot lives.
        seed: Decides sensor noise and damage.
        out: CSV file to write; by default freeze.csv in the run's folder. A picture goes beside.
    """
    from experiments.analysis.freezing import report

    _one_thread()
    report(folder, terrains, seed, out)


@_command
def render(
    folder: _Folder,
    options: Annotated[FilmOptions, tyro.conf.arg(name="")],
    run: int | None = None,
    start: float | None = None,
    seconds: float = 8.0,
    beside: tuple[str, ...] = (),
    seed: int = 0,
    out: Path | None = None,
) -> None:
    """Draw the gait of a run's champion: a page of stills, an MP4 and, if it is short, a GIF.

    Args:
        folder: Folder of the run.
        options: How films and stills look.
        run: Which one, if the folder has several; by default that of the best champion.
        start: Beginning of the film [s]; by default after the robot has learned to walk.
        seconds: Length of the film [s].
        beside: What to show beside the champion, in beside.mp4: "damaged" (voxels break with
            probability 0.5 at half of the episode), "frozen" (it stops learning when the film
            begins), or folders of other runs.
        seed: Decides terrain, sensor noise and damage of the episode shown.
        out: Folder for the files; by default the run's.
    """
    from experiments.analysis import comparison, film
    from experiments.evolution.progress import counted

    _one_thread()
    with counted("picture") as progress:
        files = film.film_run(
            folder, run=run, out=out, seed=seed, start=start, seconds=seconds, options=options,
            progress=progress,
        )  # fmt: skip
    if beside:
        with counted("picture") as progress:
            files += comparison.film_beside(
                folder, beside, run=run, out=out, seed=seed, start=start, seconds=seconds,
                options=options, progress=progress,
            )  # fmt: skip
    for path in files:
        print(f"wrote {path}")


@_command
def validate(
    reference: Path | None = None,
    json: Path | None = None,
    out: Path | None = None,
    seed: int = 0,
) -> None:
    """Compare the simulator with recorded runs; exit code 1 if any case fails.

    Args:
        reference: Folder of recorded runs; by default the project's own copy.
        json: File for the table in JSON.
        out: Folder for pictures of recorded runs and ours; by default none are drawn.
        seed: Decides the motions in the cases that need no recorded run.
    """
    from experiments.validate import validate as run_validation

    _one_thread()
    sys.exit(run_validation(reference, json, out, seed=seed))


@_command
def bench(
    json: Path | None = None,
    out: Path | None = None,
    quick: bool = False,
    profile: bool = False,
    seed: int = 0,
    threads: int | None = None,
    against: Path | None = None,
) -> None:
    """Measure how fast everything runs here, and compare it with recorded baselines.

    Args:
        json: File for the table in JSON.
        out: Folder for the table in JSON and in Markdown; by default it is only printed.
        quick: Measure less, in one to two minutes; by default it takes three to five.
        profile: Tell where the time of a robot-step goes, too.
        seed: Decides gaits, genomes and terrains.
        threads: Of the evolution; all cores if not given. All else is measured on one.
        against: Another checkout of this project: measure both in turns, and only that.
    """
    from experiments.bench import bench as run_bench

    _one_thread()
    run_bench(json, out, quick=quick, profile=profile, seed=seed, threads=threads, against=against)


@_command
def campaign(
    studies: _Studies,
    options: Annotated[CampaignOptions, tyro.conf.arg(name="")],
    grid: Path | None = None,
) -> None:
    """Run studies: every condition with all its seeds, then analyses and figures; resumable.

    Args:
        studies: Names of studies: those of experiments/studies, "paper" for all of the paper's,
            "all" for all there are.
        options: Where, how much and on what.
        grid: TOML file with a study of one's own: a table [base] with options of `evolve` and a
            table [axes] with the lists of values that others go through.
    """
    from experiments.campaign.command import campaign as run_campaign
    from experiments.studies.registry import find_studies

    _one_thread()
    sys.exit(run_campaign(find_studies(studies, grid), options))


@_command
def pack(root: _Root, out: Path, seed: int = 0) -> None:
    """Put a campaign into few files: champions, tables, checksums, figures and report.

    Args:
        root: Folder of a campaign, or any folder with finished runs below it.
        out: New folder for the files, or one that was packed before.
        seed: Decides the resampling behind the bootstrap intervals.
    """
    from experiments.report.bundle import pack as pack_runs
    from experiments.report.gallery import draw_all

    for path in pack_runs(root, out):
        print(f"wrote {path}")
    draw_all((out,), None, seed, print_quality=False)


@_command
def unpack(bundle: _Root, out: Path) -> None:
    """Restore the folders of the runs of a packed campaign, to render, evaluate or freeze them.

    Args:
        bundle: Folder that `pack` wrote.
        out: New folder for the runs.
    """
    from experiments.report.bundle import unpack as unpack_runs

    unpack_runs(bundle, out)
    print(f"wrote {out}")


@_command
def figures(roots: _Roots, seed: int = 0, out: Path | None = None) -> None:
    """Draw the paper's figures from finished runs, with their statistics and a report.

    Args:
        roots: Folder of a campaign, packed or not, or any folders with finished runs below them.
        seed: Decides the resampling behind the bootstrap intervals.
        out: Folder for the files; by default `figures` in the first folder.
    """
    from experiments.report.gallery import draw_all

    draw_all(roots, out, seed)


def main() -> None:
    """Run the command that sys.argv names. A user's mistake is one line and exit code 2."""
    try:
        _read_arguments()()
    except ValueError as error:
        print(f"hebbtorch: {error}", file=sys.stderr)
        sys.exit(_USAGE_ERROR)
    except OSError as error:
        print(f"hebbtorch: {error}", file=sys.stderr)
        sys.exit(_SYSTEM_ERROR)
    except KeyboardInterrupt:
        sys.exit(_INTERRUPTED)


def _read_arguments() -> Callable[[], None]:
    """What the command line asks for. tyro's framed complaints become one line."""
    complaint = io.StringIO()
    try:
        with contextlib.redirect_stderr(complaint):
            command: Callable[[], None] = app.cli(
                prog="hebbtorch", description="Evolve soft robots whose brains learn for life."
            )
    except SystemExit as stop:
        if stop.code and complaint.getvalue():
            raise ValueError(_unframed(complaint.getvalue())) from None
        raise
    return command


def _unframed(box: str) -> str:
    """The words of a box: without its title, and a semicolon for the line across."""
    inside = " ".join(line for line in box.splitlines() if not line.startswith(("╭", "╰")))
    words = re.sub("[─-╿]", " ", re.sub("─{3,}", "; ", inside))
    return re.sub(r"\.? +; +", "; ", " ".join(words.split()))


def _one_thread() -> None:
    """PyTorch's threads wait for each other at every operation, which costs more than these
    small networks gain; the simulator has threads of its own."""
    import torch

    torch.set_num_threads(1)


def _free_folder(config: EvolveConfig) -> Path:
    """The first of runs/NAME, runs/NAME-2, ... that does not exist."""
    name = Path("runs") / f"{config.shape}-{config.sensors}-{config.controller}"
    folder, number = name, 1
    while folder.exists():
        number += 1
        folder = name.with_name(f"{name.name}-{number}")
    return folder
