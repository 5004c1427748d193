"""Pictures of a run's champion: a strip of its gait, a GIF and an MP4.

The champion lives again, as in the re-assessment on the terrain of the same seed, up to the end
of the few seconds that are filmed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from PIL import Image
from torch import Tensor

from experiments.analysis.measures import period_of
from experiments.config import EvolveConfig
from experiments.rollout.episode import start_episode
from experiments.rollout.scenarios import Scenarios
from experiments.runs.champions import Champions
from physics import Apparatus, Terrain
from physics.render import draw, movie
from physics.scene.clock import steps_in
from physics.scene.material import DT

__all__ = ["Recording", "film_run", "record"]

_START = 20.0  # of the film [s]: by then plastic robots have learned to walk (paper, Fig. 6)
_GIF_STEPS, _MP4_STEPS = 3, 2  # control steps per picture: 20 and 30 pictures per second
_GIF_WIDTH, _MP4_WIDTH = 600, 1280  # [pixels]
_STRIP_FRAMES = 8
_JOURNEY_FRAMES = 6  # at most
_USUAL_PERIOD = 2.0  # of a gait [s]: a worm's (Sec. IV-C)


@dataclass(frozen=True)
class Recording:
    """A few seconds of a life.

    Attributes:
        title: what is shown.
        terrain: the ground.
        frames: the robot after each control step, at least two.
    """

    title: str
    terrain: Terrain
    frames: list[draw.Frame]

    @property
    def speed(self) -> float:
        """Mean velocity along x over the recording [m/s]."""
        first, last = self.frames[0], self.frames[-1]
        way = last.poses[..., 0].mean() - first.poses[..., 0].mean()
        return float(way) / (last.time - first.time)


def film_run(
    folder: Path,
    *,
    run: int | None = None,
    out: Path | None = None,
    seed: int = 0,
    start: float | None = None,
    seconds: float = 8.0,
    mp4: bool = True,
) -> list[Path]:
    """Film the champion of a run: gait.png, gait.gif and gait.mp4.

    Args:
        folder: of the run.
        run: which one, of several; by default the one with the fittest champion.
        out: folder for the files, created if need be; by default the run's.
        seed: of terrain, sensor noise, damage and the weights at birth: the life is that of the
            re-assessment on terrain ``seed``.
        start: when the film begins [s]; by default after the robot has learned to walk.
        seconds: length of the film [s], cut at the end of the life.
        mp4: whether to write the MP4 too, which takes the longest.

    Returns:
        The files written.

    Raises:
        ValueError: the run cannot be read, an option is out of range, or the simulation of the
            champion fails before the film begins.
    """
    champions = Champions.load(folder)
    n_runs = len(champions.genomes)
    run = champions.best_run if run is None else run
    if not 0 <= run < n_runs:
        raise ValueError(f"run: expected 0 to {n_runs - 1}, the runs of {folder}, got {run}")
    recording = record(
        champions.config, champions.genomes[run], seed=seed, start=start, seconds=seconds
    )
    out = folder if out is None else out
    out.mkdir(parents=True, exist_ok=True)
    movie.write_png(out / "gait.png", draw_gait(recording))
    movie.write_gif(out / "gait.gif", _film(recording, _GIF_WIDTH, _GIF_STEPS), _rate(_GIF_STEPS))
    files = [out / "gait.png", out / "gait.gif"]
    if mp4:
        movie.write_mp4(
            out / "gait.mp4", _film(recording, _MP4_WIDTH, _MP4_STEPS), _rate(_MP4_STEPS)
        )
        files.append(out / "gait.mp4")
    return files


def record(
    config: EvolveConfig,
    genome: Tensor,
    *,
    seed: int = 0,
    start: float | None = None,
    seconds: float = 8.0,
) -> Recording:
    """Let one individual live and record some seconds of it.

    Args:
        config: the conditions of the life.
        genome: shape (G,).
        seed: as in :func:`film_run`.
        start: as in :func:`film_run`.
        seconds: as in :func:`film_run`.

    Raises:
        ValueError: as in :func:`film_run`.
    """
    steps = _window(config.duration, start, seconds)
    first, last = (-(-step // config.control_interval) for step in steps)
    config = replace(config, threads=1)  # one robot gains nothing from more
    scenarios = Scenarios.unseen(config.terrain, [seed])
    (terrain,) = scenarios.terrains
    frames: list[draw.Frame] = []
    with torch.inference_mode():
        episode = start_episode(config, genome[None], scenarios)
        sim = episode.sim
        episode.run(first - 1)
        for _ in range(first, last + 1):
            episode.run(1)
            if sim.failed()[0]:
                break
            poses = sim.mass_poses()[0].double().cpu().numpy()
            readings = sim.readings()[0].double().cpu().numpy()
            rays = lidar_rays(poses, readings, sim.apparatus)
            frames.append(draw.Frame(poses, sim.time, rays=rays))
    if len(frames) < 2:
        raise ValueError(
            f"start: expected a time before the simulation of this robot fails, got "
            f"{first * DT:.1f} s; choose an earlier one, or another seed"
        )
    title = f"{config.shape}, {config.sensors} sensors, {config.controller}, {terrain.name}"
    return Recording(title, terrain, frames)


def lidar_rays(poses: np.ndarray, readings: np.ndarray, apparatus: Apparatus) -> np.ndarray | None:
    """What a robot sees: its lidars' rays, as long as they read.

    Args:
        poses: of the squares, shape (V, 4, 3).
        readings: shape (R,).
        apparatus: of the robot.

    Returns:
        Start and end of each ray [m], shape (K, 2, 2); None without lidar.
    """
    rays, reading = [], 0
    for squares, sensors in zip(poses, apparatus.sensors, strict=True):
        for sensor in sensors:
            if sensor.kind == "lidar":
                center = squares[:, :2].mean(axis=0)
                lengths = sensor.range * readings[reading : reading + sensor.n_readings]
                angles = _voxel_angle(squares) + np.radians(sensor.angles)
                directions = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
                ends = center + lengths[:, None] * directions
                rays += [(center, end) for end in ends]
            reading += sensor.n_readings
    return np.array(rays) if rays else None


def draw_gait(recording: Recording) -> Image.Image:
    """One page: a cycle of the gait, and the way made during the recording."""
    frames = recording.frames
    period = period_of(np.stack([frame.levels for frame in frames]))
    cycle = "one cycle of the gait" if period else "the gait"
    steps = min((period or _USUAL_PERIOD) / DT, len(frames) - 1)
    chosen = np.linspace(0, steps, _STRIP_FRAMES, endpoint=False).round().astype(int)
    length = frames[-1].time - frames[0].time
    return draw.stack(
        {
            f"{recording.title}: {cycle}, {steps * DT:.2f} s": draw.draw_strip(
                [frames[i] for i in chosen], recording.terrain
            ),
            f"the way in {length:.1f} s, {recording.speed:.2f} m/s": draw.draw_overlay(
                _journey(frames), recording.terrain
            ),
        }
    )


def _journey(frames: list[draw.Frame]) -> list[draw.Frame]:
    """The first and the last frame, and as many between as fit without overlap."""
    bounds = np.stack([frame.bounds for frame in (frames[0], frames[-1])])
    way = abs(bounds[1, :, 0].mean() - bounds[0, :, 0].mean())
    width = (bounds[:, 1, 0] - bounds[:, 0, 0]).max()
    n = int(np.clip(1 + way // (1.1 * width), 2, _JOURNEY_FRAMES))
    chosen = np.linspace(0, len(frames) - 1, n).round().astype(int)
    return [frames[i] for i in chosen]


def _film(recording: Recording, width: int, steps: int) -> Iterator[Image.Image]:
    caption = f"{recording.title}, {recording.speed:.2f} m/s"
    return draw.draw_film(
        recording.frames[::steps], recording.terrain, width=width, caption=caption
    )


def _rate(steps: int) -> float:
    """Pictures per second when one is drawn every so many control steps."""
    return round(1 / (steps * DT), 9)


def _window(duration: float, start: float | None, seconds: float) -> tuple[int, int]:
    """First and last engine step to record, from 1."""
    if not seconds > 0:
        raise ValueError(f"seconds: expected a number > 0, got {seconds}")
    if start is None:
        start = max(0.0, min(_START, duration - seconds))
    if not 0 <= start < duration:
        raise ValueError(f"start: expected a time within the life of {duration} s, got {start}")
    end = min(duration, start + seconds)
    first = max(1, round(start / DT))
    return first, max(steps_in(end), first + 1)


def _voxel_angle(squares: np.ndarray) -> float:
    """Mean direction of the upper and the lower side of a voxel with squares (4, 3) [rad]."""
    nw, ne, se, sw = squares[:, :2]
    upper, lower = ne - nw, se - sw
    x, y = upper / np.linalg.norm(upper) + lower / np.linalg.norm(lower)
    return math.atan2(y, x)
