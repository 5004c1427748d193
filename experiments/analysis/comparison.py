"""Films of several robots side by side, at the same times and on the same terrain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from torch import Tensor

from experiments.analysis.film import Progress, chosen_run, write_films
from experiments.analysis.film_options import FilmOptions
from experiments.analysis.recorder import record
from experiments.analysis.trajectory import Trajectory
from experiments.io.outputs import require_folder
from experiments.runs.archive import Archive
from experiments.runs.champions import Champions

__all__ = ["film_beside"]

_KINDS = ("damaged", "frozen", "generation-N")
_GENERATION = "generation-"


def film_beside(
    folder: Path,
    others: Sequence[str],
    *,
    run: int | None = None,
    out: Path | None = None,
    seed: int = 0,
    start: float | None = None,
    seconds: float = 8.0,
    options: FilmOptions | None = None,
    progress: Progress | None = None,
) -> list[Path]:
    """Film the champion of a run beside others: beside.mp4 and, if it is short, beside.gif.

    Args:
        folder: The folder of the run.
        others: "damaged", "frozen", "generation-N" (the best of a generation in the run's archive),
            or folders of other runs.
        run: which champion of `folder`, as in `film.film_run`.
        out: folder for the files, created if need be; by default the run's.
        seed: as in `film.film_run`.
        start: as in `film.film_run`.
        seconds: as in `film.film_run`.
        options: how the film looks.
        progress: called with pictures done and pictures in all.

    Returns:
        The files written.

    Raises:
        ValueError: a run cannot be read, or an option is out of range.
    """
    options = options or FilmOptions()
    options.validate()
    champions = Champions.load(folder)
    run = chosen_run(champions, folder, run)
    out = folder if out is None else out
    require_folder(out)
    genome, config = champions.genomes[run], champions.config
    if start is None and "damaged" in others:  # so that the film shows it before and after
        start = max(0.0, (config.duration - seconds) / 2)
    whole = replace(config, damage="none")
    first = record(whole, genome, seed=seed, start=start, seconds=seconds)
    begin = float(first.times[0])
    courses: dict[str, Trajectory] = {f"{folder.name}, run {run}": first}
    for other in others:
        if other == "damaged":
            damaged = replace(config, damage="half")
            courses["damaged"] = record(damaged, genome, seed=seed, start=begin, seconds=seconds)
        elif other == "frozen":
            courses[f"weights frozen at {begin:.1f} s"] = record(
                whole, genome, seed=seed, start=begin, seconds=seconds, freeze_at=begin
            )
        elif other.startswith(_GENERATION):
            generation, early = _of_generation(folder, other, run)
            courses[f"best of generation {generation}"] = record(
                whole, early, seed=seed, start=begin, seconds=seconds
            )
        else:
            theirs = _read(other)
            own = theirs.best_run
            conditions = replace(theirs.config, damage="none", terrain=config.terrain)
            courses[f"{Path(other).name}, run {own}"] = record(
                conditions, theirs.genomes[own], seed=seed, start=begin, seconds=seconds
            )
    out.mkdir(parents=True, exist_ok=True)
    return write_films(courses, out / "beside", options, progress=progress)


def _of_generation(folder: Path, name: str, run: int) -> tuple[int, Tensor]:
    """The best individual of a generation, such as "generation-25", as the archive keeps it."""
    archive = Archive.load(folder)
    kept = [] if archive is None else archive.generations.tolist()
    wanted = name.removeprefix(_GENERATION)
    if archive is None or not wanted.isdecimal() or int(wanted) not in kept:
        raise ValueError(
            f"beside: expected generation-N with N of {', '.join(map(str, kept)) or 'none kept'} "
            f"in the archive of {folder}, got {name!r}"
        )
    return int(wanted), archive.genomes[kept.index(int(wanted)), run]


def _read(folder: str) -> Champions:
    if not Path(folder).is_dir():
        raise ValueError(
            f"beside: expected {', '.join(_KINDS)} or the folder of a run, got {folder!r}"
        )
    return Champions.load(Path(folder))
