"""Pictures and films of a run's champion, alone or beside others.

A page of stills with one cycle of its gait and the way it makes, an MP4, and a GIF of short films.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np
from PIL import Image

from experiments.analysis import trajectory_file
from experiments.analysis.film_options import FilmOptions
from experiments.analysis.recorder import record
from experiments.analysis.spectrum import period_of
from experiments.analysis.trajectory import Trajectory
from experiments.io.outputs import require_folder
from experiments.runs.champions import Champions
from physics import DT
from physics.render import draw, movie, palette

__all__ = ["chosen_run", "draw_gait", "film_run", "side_by_side", "write_films"]

_GIF_FPS, _GIF_WIDTH = 20.0, 600
_GIF_LONGEST = 20.0  # [s] that a GIF is made of unasked
_GIF_SAMPLES = 12  # pictures that its palette is taken from
_STRIP_FRAMES = 8
_JOURNEY_FRAMES = 6  # at most
_USUAL_PERIOD = 2.0  # of a gait [s]: a worm's (Sec. IV-C)
_LANDING = 1.0  # [s]: by then a robot has come down and set out
_STANDING = 0.05, 0.01  # a robot stands below this speed [m/s] and this spread of its areas

Progress = Callable[[int, int], None]


def film_run(
    folder: Path,
    *,
    run: int | None = None,
    out: Path | None = None,
    seed: int = 0,
    start: float | None = None,
    seconds: float = 8.0,
    mp4: bool = True,
    options: FilmOptions | None = None,
    progress: Progress | None = None,
) -> list[Path]:
    """Film the champion of a run: gait.png, gait.mp4 and, if it is short, gait.gif.

    Args:
        folder: The folder of the run; or a file with a recorded trajectory, filmed as it is.
        run: which one, of several; by default the one with the fittest champion.
        out: folder for the files, created if need be; by default the run's, or the file's.
        seed: The seed of terrain, sensor noise, damage and initial weights: the episode is that of
            the re-assessment on terrain ``seed``.
        start: when the film begins [s]; by default after the robot has learned to walk.
        seconds: length of the film [s], cut at the end of the episode.
        mp4: whether to write the MP4 too, which takes the longest.
        options: how it looks.
        progress: called with pictures done and pictures in all.

    Returns:
        The files written.

    Raises:
        ValueError: the run cannot be read, an option is out of range, or the simulation of the
            champion fails before the film begins.
    """
    options = options or FilmOptions()
    options.validate()
    if out is None:
        out = folder.parent if folder.is_file() else folder
    if folder.is_file():
        require_folder(out)
        course, origin = trajectory_file.load(folder), folder.stem
    else:
        champions = Champions.load(folder)
        run = chosen_run(champions, folder, run)
        require_folder(out)
        course = record(
            champions.config, champions.genomes[run], seed=seed, start=start, seconds=seconds
        )
        origin = f"run {run}, generation {champions.config.generations}"
    out.mkdir(parents=True, exist_ok=True)
    files = [out / f"gait.{suffix}" for suffix in options.stills]
    page = draw_gait(course, origin, options)
    for path in files:
        movie.write_still(path, page)
    return files + write_films({origin: course}, out / "gait", options, mp4, progress)


def chosen_run(champions: Champions, folder: Path, run: int | None) -> int:
    """The run asked for, or that of the fittest champion.

    Raises:
        ValueError: there is no such run.
    """
    n_runs = len(champions.genomes)
    run = champions.best_run if run is None else run
    if not 0 <= run < n_runs:
        raise ValueError(f"run: expected 0 to {n_runs - 1}, the runs of {folder}, got {run}")
    return run


def write_films(
    courses: Mapping[str, Trajectory],
    stem: Path,
    options: FilmOptions,
    mp4: bool = True,
    progress: Progress | None = None,
) -> list[Path]:
    """Write stem.mp4 and stem.gif.

    Args:
        courses: what is shown, each under its name; several are shown side by side.
        stem: path of the files without their suffix.
        options: how they look.
        mp4: whether to write the MP4.
        progress: called with pictures done and pictures in all.

    Returns:
        The files written.
    """
    length = max(float(course.times[-1] - course.times[0]) for course in courses.values())
    gif = options.gif == "yes" or (options.gif == "auto" and length <= _GIF_LONGEST)
    n_mp4 = len(_instants(courses, options.fps)) if mp4 else 0
    n_gif = len(_instants(courses, _GIF_FPS)) if gif else 0
    files, done = [], 0

    def told(images: Iterator[Image.Image]) -> Iterator[Image.Image]:
        nonlocal done
        for image in images:
            yield image
            done += 1
            if progress is not None:
                progress(done, n_mp4 + n_gif)

    if gif:
        path = stem.with_suffix(".gif")
        film = side_by_side(courses, _GIF_WIDTH, _GIF_FPS, options)
        samples = list(side_by_side(courses, _GIF_WIDTH, _GIF_FPS, options, _GIF_SAMPLES))
        movie.write_gif(path, told(film), _GIF_FPS, samples)
        files.append(path)
    if mp4:
        path = stem.with_suffix(".mp4")
        film = side_by_side(courses, options.width, options.fps, options)
        movie.write_mp4(path, told(film), options.fps)
        files.append(path)
    return files


def side_by_side(
    courses: Mapping[str, Trajectory],
    width: int,
    fps: float,
    options: FilmOptions,
    at_most: int | None = None,
) -> Iterator[Image.Image]:
    """The pictures of a film, drawn one by one, of one robot or of several at the same times.

    Args:
        courses: The recorded episodes of the robots, each under its name; they may differ in
            length.
        width: The width of the picture [pixels].
        fps: pictures per second.
        options: how it looks.
        at_most: so many pictures, spread over the film, instead of all.
    """
    columns = min(len(courses), 2)
    each_width = width // columns // 2 * 2
    instants = _instants(courses, fps)
    if at_most is not None and len(instants) > at_most:
        instants = instants[np.linspace(0, len(instants) - 1, at_most).round().astype(int)]
    films: list[Iterator[Image.Image]] = []
    for name, course in courses.items():
        places = np.searchsorted(course.times, instants - DT / 2).clip(max=len(course.times) - 1)
        frames = course.frames(places, by_area=options.color == "area")
        caption = f"{course.title}\n{name}, {course.speed:.2f} m/s"
        films.append(
            draw.draw_film(
                frames,
                course.terrain,
                width=each_width,
                caption=caption,
                scale=palette.SCALES[options.palette],
                legend=not films,
            )
        )
    for images in zip(*films, strict=True):
        yield images[0] if len(images) == 1 else draw.beside(images, columns)


def draw_gait(course: Trajectory, origin: str, options: FilmOptions | None = None) -> draw.Picture:
    """One page: a cycle of the gait, and the way made during the recording.

    Args:
        course: a recording of at least a cycle, at every control step.
        origin: where the individual comes from, such as "run 0, generation 60".
        options: how it looks.
    """
    options = options or FilmOptions()
    by_area, scale = options.color == "area", palette.SCALES[options.palette]
    heading = f"{course.title}, {origin}"
    if _stands(course):
        return draw.stack(
            {
                f"{heading}: it stands, {course.speed:.2f} m/s": draw.draw_overlay(
                    course.frames(slice(-1, None), by_area=by_area), course.terrain, scale=scale
                )
            },
            scale,
        )
    cycle, name = _cycle(course)
    length = course.times[-1] - course.times[0]
    return draw.stack(
        {
            f"{heading}: {name}": draw.draw_strip(
                course.frames(cycle, by_area=by_area), course.terrain, scale=scale
            ),
            f"the way in {length:.1f} s, {course.speed:.2f} m/s": draw.draw_overlay(
                course.frames(_journey(course), by_area=by_area), course.terrain, scale=scale
            ),
        },
        scale,
    )


def _instants(courses: Mapping[str, Trajectory], fps: float) -> np.ndarray:
    """Times of the pictures of a film [s]."""
    first = min(course.times[0] for course in courses.values())
    last = max(course.times[-1] for course in courses.values())
    return first + np.arange(math.floor((last - first) * fps + 1e-6) + 1) / fps


def _stands(course: Trajectory) -> bool:
    """Whether the robot neither moves on nor changes its shape."""
    speed, spread = _STANDING
    after = course.areas[course.times >= min(_LANDING, course.times[-1] / 2)]
    return abs(course.speed) < speed and float(after.std(axis=0).max()) < spread


def _cycle(course: Trajectory) -> tuple[np.ndarray, str]:
    """Instants of one cycle of the gait, after the landing where the recording is long enough,
    and what to call them."""
    times = course.times
    period = period_of(course.areas, float(np.diff(times).mean()))
    length = min(period or _USUAL_PERIOD, times[-1] - times[0])
    begin = times[0] if times[-1] - _LANDING < length else max(times[0], _LANDING)
    wanted = begin + np.linspace(0, length, _STRIP_FRAMES, endpoint=False)
    chosen = np.unique(np.searchsorted(times, wanted - DT / 2).clip(max=len(times) - 1))
    return chosen, f"{'one cycle of the gait' if period else 'the gait'}, {length:.2f} s"


def _journey(course: Trajectory) -> np.ndarray:
    """The first and the last instant, and as many between as fit without overlap."""
    ends = course.frames(np.array([0, len(course.times) - 1]))
    bounds = np.stack([frame.bounds for frame in ends])
    way = abs(bounds[1, :, 0].mean() - bounds[0, :, 0].mean())
    width = (bounds[:, 1, 0] - bounds[:, 0, 0]).max()
    n = int(np.clip(1 + way // (1.1 * width), 2, _JOURNEY_FRAMES))
    return np.linspace(0, len(course.times) - 1, n).round().astype(int)
