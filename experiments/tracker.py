"""TensorBoard: scalars, options, pictures and films of an evolution.

Tags are grouped: fitness/ genome/ plasticity/ physics/ time/. A run writes into the folder RUN;
several runs into RUN/run-0, RUN/run-1 ..., with their median and quartiles beside them.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import torch
from PIL import Image
from tensorboard.compat.proto.summary_pb2 import Summary
from torch.utils.tensorboard import SummaryWriter

from experiments.config import EvolveConfig

__all__ = ["Tracker"]

_RGB = 3
_OVER_RUNS = {"over-runs/q25": 0.25, "over-runs/median": 0.5, "over-runs/q75": 0.75}


class Tracker:
    """Writes the event files of an evolution."""

    def __init__(self, folder: Path, config: EvolveConfig, generation: int) -> None:
        """Open the event files, to log from a generation on.

        Args:
            folder: RUN.
            config: the options, logged as text.
            generation: the first one to be logged; of what an interrupted evolution logged for
                it and later ones, nothing is shown.
        """
        if config.runs == 1:
            folders = [folder]
        else:
            folders = [folder / f"run-{run}" for run in range(config.runs)]
        _wait_for_new_names(folders[0])
        self._runs = [SummaryWriter(str(path), purge_step=generation) for path in folders]
        self._over_runs = {
            quantile: SummaryWriter(str(folder / name), purge_step=generation)
            for name, quantile in _OVER_RUNS.items()
            if config.runs > 1
        }
        if generation == 1:
            for writer in self._runs:
                writer.add_text("config", _table(config), 0)

    def log(self, generation: int, metrics: Sequence[dict[str, float]]) -> None:
        """Write the numbers of one generation, a dict of tag and value for each run."""
        for writer, values in zip(self._runs, metrics, strict=True):
            for tag, value in values.items():
                writer.add_scalar(tag, value, generation)
        for quantile, writer in self._over_runs.items():
            for tag in metrics[0]:
                values_of_runs = torch.tensor([values[tag] for values in metrics])
                writer.add_scalar(tag, values_of_runs.nanquantile(quantile).item(), generation)

    def show(self, run: int, generation: int, pictures: Sequence[Path]) -> None:
        """Show picture files (PNG, GIF; others are passed over) of a run in the Images tab."""
        for path in pictures:
            if path.suffix not in (".png", ".gif"):
                continue
            with Image.open(path) as image:
                width, height = image.size
            content = Summary.Image(
                width=width,
                height=height,
                colorspace=_RGB,
                encoded_image_string=path.read_bytes(),  # a GIF stays animated
            )
            value = Summary.Value(tag=f"champion/{path.name}", image=content)
            writer: Any = self._runs[run].file_writer  # SummaryWriter itself takes no GIF
            writer.add_summary(Summary(value=[value]), generation)

    def flush(self) -> None:
        """Hand everything logged to the operating system."""
        for writer in (*self._runs, *self._over_runs.values()):
            writer.flush()

    def close(self) -> None:
        """Write what is left and close the files."""
        for writer in (*self._runs, *self._over_runs.values()):
            writer.close()

    def __enter__(self) -> Tracker:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()


def _wait_for_new_names(folder: Path) -> None:
    """TensorBoard reads event files in the order of their names, which begin with the second of
    their creation; a run that was resumed within a second would be read in disorder."""
    seconds = [int(path.name.split(".")[3]) for path in folder.glob("events.out.tfevents.*")]
    time.sleep(min(max(0.0, max(seconds, default=0) + 1 - time.time()), 1.0))


def _table(config: EvolveConfig) -> str:
    """The options as a Markdown table."""
    rows = [f"| {name} | {value} |" for name, value in dataclasses.asdict(config).items()]
    return "\n".join(["| option | value |", "|---|---|", *rows])
