"""How what was observed of champions gets into TensorBoard."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from experiments.evolution.observation import Observation
from experiments.runs.tensorboard import EventFile, Tracker
from experiments.runs.tensorboard.heatmap import heat_map
from physics import Terrain
from physics.render import Frame, draw, movie

__all__ = ["show"]

_FILM_WIDTH, _STRIP_WIDTH = 320, 960  # [pixels]
_STRIP_FRAMES = 6


def show(
    tracker: Tracker,
    generation: int,
    observations: Sequence[Observation],
    terrain: Terrain,
    pictured: bool,
) -> None:
    """Log what was observed of the champion of each run; pictures of that of the first one.

    Args:
        tracker: The tracker of the evolution.
        generation: The generation in which they were the best.
        observations: one for each run.
        terrain: The terrain on which they were filmed.
        pictured: whether to show films and matrices, too.
    """
    tracker.log_more(generation, [each.metrics for each in observations])
    for run, (file, seen) in enumerate(zip(tracker.runs, observations, strict=True)):
        for k, weights in enumerate(seen.weights):
            file.histogram(f"weights/layer{k}", weights, generation)
        for term in dict.fromkeys(name.split("/")[0] for name in seen.rules):
            layers = [values for name, values in seen.rules.items() if name.split("/")[0] == term]
            all_of_term = np.concatenate([values.ravel() for values in layers])
            file.histogram(f"rules/{term}", all_of_term, generation)
        if pictured and run == 0:
            for name, values in seen.rules.items():
                words = f"{name}, rows: neurons, columns: inputs"
                file.image(f"rules/{name}", heat_map(values, words), generation)
            if len(seen.frames) > 1:
                _film(file, generation, seen.frames, terrain)


def _film(file: EventFile, generation: int, frames: list[Frame], terrain: Terrain) -> None:
    """Show the robot moving, and a few instants beside each other."""
    chosen = np.linspace(0, len(frames) - 1, min(_STRIP_FRAMES, len(frames))).round().astype(int)
    strip = draw.draw_strip([frames[i] for i in chosen], terrain, width=_STRIP_WIDTH)
    file.image("champion/strip", strip.image(), generation)
    film = draw.draw_film(
        frames, terrain, width=_FILM_WIDTH, caption=f"generation {generation}", legend=False
    )
    fps = (len(frames) - 1) / (frames[-1].time - frames[0].time)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "film.gif"
        movie.write_gif(path, film, fps)
        file.picture_file("champion/film", path, generation)
