"""The commands on one run: evolve, evaluate, freeze, render."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Literal

import tyro

from experiments.analysis.film_options import FilmOptions
from experiments.cli.arguments import RunFolder, RunOrFile, one_thread
from experiments.cli.evolve_options import GroupedOptions, flat
from experiments.config import EvolveConfig

__all__ = ["COMMANDS"]

_WITH_RESUME = ("generations", "device", "threads")


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
        options: The options of the evolution, by their groups.
        out: New folder for the run; by default, a free name in runs/.
        resume: Folder of a run to go on with, exactly; its options are those it has. With
            --generations beside it, the run gets that length; --device and --threads say what
            goes on with it.
    """
    from experiments.evolution import launch

    one_thread()
    config = flat(options)
    if resume is None:
        launch.evolve(config, out or _free_folder(config))
        return
    words = {word.split("=")[0] for word in sys.argv}
    asked = {name: getattr(config, name) for name in _WITH_RESUME if f"--{name}" in words}
    if out is not None or config != EvolveConfig(**asked):
        raise ValueError(
            "resume: expected no other option than --generations, --device and --threads, since a "
            f"run goes on with those it has; got some: use --resume {resume} alone, or start anew "
            "with --out"
        )
    launch.resume(resume, asked.pop("generations", None), asked)


def evaluate(
    folder: RunFolder,
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

    one_thread()
    evaluate_run(
        folder,
        terrains,
        None if terrain == "same" else terrain,
        None if damage == "same" else damage,
        seed,
        out,
        change,
    )


def freeze(
    folder: RunFolder,
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

    one_thread()
    freeze_run(folder, terrains, seed, out)


def record(
    folder: RunFolder,
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
    from experiments.analysis.recorder import record as record_course
    from experiments.runs.champions import Champions

    one_thread()
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


def render(
    folder: RunOrFile,
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

    one_thread()
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


def _free_folder(config: EvolveConfig) -> Path:
    """The first of runs/NAME, runs/NAME-2, ... that does not exist."""
    name = Path("runs") / f"{config.shape}-{config.sensors}-{config.controller}"
    folder, number = name, 1
    while folder.exists():
        number += 1
        folder = name.with_name(f"{name.name}-{number}")
    return folder


COMMANDS = (evolve, evaluate, freeze, record, render)
