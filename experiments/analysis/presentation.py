"""What is shown of champions once their evolution is done: pictures, films, their episode."""

from __future__ import annotations

from pathlib import Path

from PIL import Image

from experiments.analysis import film
from experiments.analysis.episode_log import log_episode
from experiments.io import terminal
from experiments.runs.champions import Champions
from experiments.runs.tensorboard import EventFile
from experiments.runs.tensorboard.tracker import run_folders

__all__ = ["log_champion", "present"]


def present(folder: Path, champions: Champions) -> None:
    """Write pictures of the best champion, log its episode, and tell what there is to see.

    Args:
        folder: The folder of the run.
        champions: The champions of the run.
    """
    for run, speed in enumerate(champions.fitness.tolist()):
        terminal.say(f"champion of run {run}: {speed:.2f} m/s")
    files = film.film_run(folder, mp4=False)  # `render` makes one
    life = log_champion(folder, champions, files[0])
    for path in files:
        terminal.say(f"wrote {path}")
        terminal.show_in_notebook(path)
    terminal.say(f"wrote {life}, its episode second by second")
    terminal.say(f"curves, pictures and films:  tensorboard --logdir {folder}")
    terminal.say(f"one page to read or to send: hebbtorch report {folder}")


def log_champion(folder: Path, champions: Champions, page: Path | None = None) -> Path:
    """Show the best champion of a run in TensorBoard: its episode and, if there is one, a page
    of pictures of its gait.

    Args:
        folder: The folder of the run.
        champions: The champions of the run.
        page: A PNG file with stills of the gait; None: no page is shown.

    Returns:
        The folder of the episode's event file.
    """
    config, best = champions.config, champions.best_run
    own = run_folders(folder, config.runs)[best]
    if page is not None:
        with EventFile(own, part="gait") as file, Image.open(page) as image:
            file.image("champion/gait", image, config.generations)
    return log_episode(own, config, champions.genomes[best])
