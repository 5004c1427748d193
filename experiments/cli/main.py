"""The command line, `hebbtorch <command>`.

Commands import what they need when they run, so that --help answers at once.
"""

from __future__ import annotations

import contextlib
import functools
import io
import logging
import re
import sys
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro
from tyro.extras import SubcommandApp

from experiments.analysis.film_options import FilmOptions
from experiments.campaign.options import CampaignOptions
from experiments.cli import process
from experiments.cli.evolve_options import GroupedOptions, flat
from experiments.config import EvolveConfig
from experiments.io import terminal

__all__ = ["main"]

_SYSTEM_ERROR, _USAGE_ERROR, _INTERRUPTED, _TERMINATED = 1, 2, 130, 143
_QUIET = ("--quiet", "-q")
_DESCRIPTION = """Evolve controllers of soft robots whose synapses change while they act.

Every command takes --quiet (-q): nothing but warnings and errors. `hebbtorch --version` prints
the version; with NO_COLOR set, nothing is coloured."""

_COMMANDS: list[Callable[..., None]] = []


def _command(function: Callable[..., None]) -> Callable[..., None]:
    """Registers a command."""
    _COMMANDS.append(function)
    return function


def _app(chosen: str) -> SubcommandApp:
    """All commands. The arguments are read first, and a command runs when all of them are.

    Args:
        chosen: the command whose help shows its examples; the list of commands shows none.
    """
    app = SubcommandApp()
    for function in _COMMANDS:

        def read(*args: Any, _call: Callable[..., None] = function, **kwargs: Any) -> Any:
            if kwargs.get("seed", 0) < 0:
                raise ValueError(f"seed: expected an integer >= 0, got {kwargs['seed']}")
            return functools.partial(_call, *args, **kwargs)

        functools.update_wrapper(read, function)
        if function.__name__ != chosen:
            read.__doc__ = re.sub(r"\n    For example:\n(        .*\n)+", "", read.__doc__ or "")
        app.command(read)
    return app


_Folder = Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
_Film = Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN|FILE")]
_Report = Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN|ROOT|FILE")]
_Roots = Annotated[tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="ROOT|FILE [...]")]
_Root = Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="ROOT")]
_Studies = Annotated[
    tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="[STUDY [STUDY ...]]")
]


@_command
def evolve(
    options: Annotated[GroupedOptions, tyro.conf.arg(name="")],
    out: Path | None = None,
    resume: Path | None = None,
) -> None:
    """Evolve controllers; one or several runs.

    For example:
        hebbtorch evolve --generations 60 --out runs/first
        hebbtorch evolve --shape worm-7x1 --sensors high --runs 10
        hebbtorch evolve --resume runs/first

    Args:
        options: of the evolution, by their groups.
        out: New folder for the run; by default, a free name in runs/.
        resume: Folder of a run to go on with, exactly; its options are those it has. With
            --generations beside it, the run gets that length.
    """
    from experiments.evolution import launch

    _one_thread()
    config = flat(options)
    if resume is None:
        launch.evolve(config, out or _free_folder(config))
        return
    if out is not None or config != EvolveConfig(generations=config.generations):
        raise ValueError(
            "resume: expected no other option than --generations, since a run goes on with those "
            f"it has; got some: use --resume {resume} alone, or start anew with --out"
        )
    asked = any(word.split("=")[0] == "--generations" for word in sys.argv)
    launch.resume(resume, config.generations if asked else None)


@_command
def evaluate(
    folder: _Folder,
    terrains: int = 10,
    terrain: str = "same",
    damage: Literal["same", "none", "half"] = "same",
    change: tuple[str, ...] = (),
    seed: int = 0,
    out: Path | None = None,
) -> None:
    """Re-assess the champions of a run on terrains that its evolution never met.

    For example:
        hebbtorch evaluate runs/first
        hebbtorch evaluate runs/first --terrain flat --damage half
        hebbtorch evaluate runs/first --change gravity=5 noise_lidar=0.1 control_delay=2

    Args:
        folder: Folder of the run.
        terrains: Number of terrains.
        terrain: Kind of terrain, such as hilly-3-30 or flat, or the same as in the evolution.
        damage: As in `evolve`, or the same as in the evolution.
        change: Other conditions than in the evolution, each NAME=VALUE: noise (of all sensors, or
            noise_area and so on), gravity, friction, springs, control interval, delay and cut-off,
            and how damage is.
        seed: Decides sensor noise and damage.
        out: CSV file to write; by default one in the run's folder, named after the conditions.
    """
    from experiments.analysis.unseen import evaluate_run

    _one_thread()
    evaluate_run(
        folder,
        terrains,
        None if terrain == "same" else terrain,
        None if damage == "same" else damage,
        seed,
        out,
        change,
    )


@_command
def freeze(
    folder: _Folder,
    terrains: int = 3,
    seed: int = 0,
    out: Path | None = None,
) -> None:
    """Assess champions with weights frozen at each second of an episode.

    For example:
        hebbtorch freeze runs/first
        hebbtorch freeze runs/first --terrains 10

    Args:
        folder: Folder of the run.
        terrains: Number of unseen terrains on which each snapshot is assessed.
        seed: Decides sensor noise and damage.
        out: CSV file to write; by default freeze.csv in the run's folder. A picture goes beside.
    """
    from experiments.analysis.freezing import freeze_run

    _one_thread()
    freeze_run(folder, terrains, seed, out)


@_command
def record(
    folder: _Folder,
    out: Path,
    run: int | None = None,
    start: float = 0.0,
    seconds: float | None = None,
    every: int = 1,
    weights_every: float = 0.5,
    seed: int = 0,
) -> None:
    """Record an episode of a run's champion into one file, for render, figures, report, validate.

    The file holds poses, actuation, contacts, readings, rewards, activations and weights;
    docs/howto/trajectories.md says how.

    For example:
        hebbtorch record runs/first --out walk.safetensors
        hebbtorch record runs/first --out walk.safetensors --start 20 --seconds 8 --every 2

    Args:
        folder: Folder of the run.
        out: File to write, ending in .safetensors; it is replaced.
        run: Which one, if the folder has several; by default that of the best champion.
        start: Beginning of the recording [s].
        seconds: Length of the recording [s]; by default all of the episode.
        every: Control steps between two recorded instants.
        weights_every: Seconds between two recordings of the weights.
        seed: Decides terrain, sensor noise and damage of the episode.
    """
    from experiments.analysis import trajectory_file
    from experiments.analysis.film import chosen_run
    from experiments.analysis.trajectory import record as record_course
    from experiments.runs.champions import Champions

    _one_thread()
    trajectory_file.check_path(out)
    if every < 1:
        raise ValueError(f"every: expected an integer >= 1, got {every}")
    champions = Champions.load(folder)
    genome = champions.genomes[chosen_run(champions, folder, run)]
    course = record_course(
        champions.config, genome, seed=seed, start=start, seconds=seconds, every=every,
        weights_every=weights_every,
    )  # fmt: skip
    trajectory_file.save(course, out)
    print(f"wrote {out}: {len(course.times)} instants, {course.speed:.2f} m/s")


@_command
def render(
    folder: _Film,
    look: FilmOptions,
    run: int | None = None,
    start: float | None = None,
    seconds: float = 8.0,
    beside: tuple[str, ...] = (),
    seed: int = 0,
    out: Path | None = None,
) -> None:
    """Draw the gait of a run's champion: a page of stills, an MP4 and, if it is short, a GIF.

    For example:
        hebbtorch render runs/first
        hebbtorch render runs/first --start 0 --seconds 60 --gif no
        hebbtorch render walk.safetensors
        hebbtorch render runs/first --beside damaged frozen --stills png pdf

    Args:
        folder: Folder of the run, or a file that `record` wrote.
        look: How films and stills look.
        run: Which one, if the folder has several; by default that of the best champion.
        start: Beginning of the film [s]; by default after the robot has learned to walk.
        seconds: Length of the film [s].
        beside: What to show beside the champion, in beside.mp4: "damaged" (voxels break with
            probability 0.5 at half of the episode), "frozen" (it stops learning when the film
            begins), "generation-N" (the best of generation 1, 25, 50, ...), or folders of other
            runs.
        seed: Decides terrain, sensor noise and damage of the episode shown.
        out: Folder for the files; by default the run's.
    """
    from experiments.analysis import comparison, film
    from experiments.evolution.progress import counted

    _one_thread()
    with counted("picture") as progress:
        files = film.film_run(
            folder, run=run, out=out, seed=seed, start=start, seconds=seconds, options=look,
            progress=progress,
        )  # fmt: skip
    if beside:
        with counted("picture") as progress:
            files += comparison.film_beside(
                folder, beside, run=run, out=out, seed=seed, start=start, seconds=seconds,
                options=look, progress=progress,
            )  # fmt: skip
    for path in files:
        print(f"wrote {path}")


@_command
def validate(
    reference: Path | None = None,
    json: Path | None = None,
    out: Path | None = None,
    seed: int = 0,
    trajectory: tuple[Path, ...] = (),
) -> None:
    """Compare the simulator with recorded runs; exit code 1 if any case fails.

    For example:
        hebbtorch validate
        hebbtorch validate --out pictures --json validation.json

    Args:
        reference: Folder of recorded runs; by default the project's own copy.
        json: File for the table in JSON.
        out: Folder for pictures of recorded runs and ours; by default none are drawn.
        seed: Decides the motions in the cases that need no recorded run.
        trajectory: Files that `record` wrote: replay their actuation, and only that.
    """
    from experiments.validate import validate as run_validation

    _one_thread()
    sys.exit(run_validation(reference, json, out, seed=seed, trajectories_of=trajectory))


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

    For example:
        hebbtorch bench --quick
        hebbtorch bench --profile --out bench

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

    _one_thread()
    sys.exit(run_campaign(find_studies(studies, grid), options))


@_command
def report(folder: _Report, seed: int = 0, out: Path | None = None) -> None:
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

    _one_thread()
    write_page(folder, out, seed)


@_command
def pack(root: _Root, out: Path, seed: int = 0) -> None:
    """Put a campaign into few files: champions, tables, checksums, figures and report.

    For example:
        hebbtorch pack runs/paper --out paper

    Args:
        root: Folder of a campaign, or any folder with finished runs below it.
        out: New folder for the files, or one that was packed before.
        seed: Decides the resampling behind the bootstrap intervals.
    """
    from experiments.report.bundle import pack as pack_runs
    from experiments.report.gallery import draw_all

    for path in pack_runs(root, out):
        print(f"wrote {path}")
    _tell_what_is_missing(draw_all((out,), None, seed, print_quality=False))


@_command
def unpack(bundle: _Root, out: Path) -> None:
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


@_command
def soak(
    minutes: float = 10.0,
    seed: int = 0,
    json: Path | None = None,
    out: Path | None = None,
) -> None:
    """Try the promises for some minutes at random: worlds, kills, damaged files; print counts.

    The exit code is 1 if one did not hold. It runs in one process, on one core.

    Args:
        minutes: About how long it takes.
        seed: Decides every trial.
        json: File for the counts in JSON.
        out: Folder for the runs; by default a temporary one.
    """
    from experiments.io.outputs import make_room
    from experiments.soak.trials import soak as run_soak

    _one_thread()
    if not 0 < minutes < 1e6:
        raise ValueError(f"minutes: expected a number > 0, got {minutes}")
    make_room(json, out)
    sys.exit(run_soak(minutes, seed, json, out))


@_command
def figures(roots: _Roots, seed: int = 0, out: Path | None = None) -> None:
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


def main() -> None:
    """Run the command that sys.argv names. A user's mistake is one line and exit code 2.

    Besides the commands, --version and --quiet are known, the latter anywhere among the options.
    """
    process.prepare()
    arguments = sys.argv[1:]
    quiet = [each for each in arguments if each in _QUIET]
    arguments = [each for each in arguments if each not in _QUIET]
    logging.basicConfig(format="%(message)s", level=logging.WARNING)
    try:
        if arguments == ["--version"]:
            print(f"hebbtorch {version('hebbtorch')}")
            return
        command = _read_arguments(arguments or ["--help"])
        with terminal.quiet() if quiet else contextlib.nullcontext():
            command()
    except ValueError as error:
        print(f"hebbtorch: {error}", file=sys.stderr)
        sys.exit(_USAGE_ERROR)
    except OSError as error:
        print(f"hebbtorch: {error}", file=sys.stderr)
        sys.exit(_SYSTEM_ERROR)
    except process.Terminated:
        sys.exit(_TERMINATED)
    except KeyboardInterrupt:
        sys.exit(_INTERRUPTED)


def _read_arguments(arguments: list[str]) -> Callable[[], None]:
    """What the command line asks for. tyro's framed complaints become one line."""
    complaint = io.StringIO()
    try:
        with contextlib.redirect_stderr(complaint):
            command: Callable[[], None] = _app(arguments[0]).cli(
                prog="hebbtorch",
                description=_DESCRIPTION,
                args=arguments,
                config=(tyro.conf.OmitArgPrefixes,),
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


def _tell_what_is_missing(figures: Sequence[str]) -> None:
    """Name, for each figure that was not drawn, the study whose runs it needs."""
    from experiments.studies.registry import STUDIES

    for figure in figures:
        study = next(study.name for study in STUDIES.values() if figure in study.figures)
        print(f"not drawn: {figure}; `hebbtorch campaign {study} --out ROOT` makes what it needs")


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
