"""TensorBoard: scalars, options, pictures and films of an evolution.

Tags are grouped: fitness/ genome/ plasticity/ physics/ time/ champion/. A run writes into the
folder RUN; several runs into RUN/run-0, RUN/run-1 ..., with their median and quartiles in
RUN/over-runs: as curves to lay over those of the runs, and as bands in the Custom Scalars tab.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from PIL import Image
from tensorboard.compat.proto.summary_pb2 import Summary
from torch.utils.tensorboard import SummaryWriter

from experiments.config import EvolveConfig

__all__ = ["Tracker"]

_RGB = 3
_OVER_RUNS = {"q25": 0.25, "median": 0.5, "q75": 0.75}
_BANDS = ("fitness/best", "fitness/median", "fitness/mean", "fitness/q75")


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
        first = generation if generation > 1 else 0  # the options stand at step 0
        self._runs = [SummaryWriter(str(path), purge_step=first) for path in folders]
        self._over_runs: dict[str, SummaryWriter] = {}
        self._bands: list[SummaryWriter] = []
        if config.runs > 1:
            together = folder / "over-runs"
            self._over_runs = {
                name: SummaryWriter(str(together / name), purge_step=first) for name in _OVER_RUNS
            }
            self._bands = [SummaryWriter(str(together), purge_step=first)]
        if generation == 1:
            for writer in self._runs:
                writer.add_text("config", _table(config), 0)
            for writer in self._bands:
                writer.add_custom_scalars(_layout())

    def log(self, generation: int, metrics: Sequence[dict[str, float]]) -> None:
        """Write the numbers of one generation, a dict of tag and value for each run."""
        for writer, values in zip(self._runs, metrics, strict=True):
            for tag, value in values.items():
                writer.add_scalar(tag, value, generation)
        for name, writer in self._over_runs.items():
            for tag in metrics[0]:
                values_of_runs = torch.tensor([values[tag] for values in metrics])
                value = values_of_runs.nanquantile(_OVER_RUNS[name]).item()
                writer.add_scalar(tag, value, generation)
                for bands in self._bands if tag in _BANDS else ():
                    bands.add_scalar(f"{tag}/{name}", value, generation)

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

    def show_weights(
        self, run: int, second: float, weights: np.ndarray, shares: Mapping[str, float | None]
    ) -> None:
        """Write how a champion's weights are distributed at some time of its life.

        Args:
            run: which champion.
            second: of its life [s]; whole ones stand where TensorBoard counts generations.
            weights: all of them, shape (n,).
            shares: of the terms of the rule in their change, by name; None is passed over.
        """
        writer, step = self._runs[run], round(second)
        finite = weights[np.isfinite(weights)]
        if finite.size:
            writer.add_histogram("champion/weights_by_second", finite, step)
        for term, share in shares.items():
            if share is not None:
                writer.add_scalar(f"champion/share_of_{term}_by_second", share, step)

    @property
    def _writers(self) -> list[SummaryWriter]:
        return [*self._runs, *self._over_runs.values(), *self._bands]

    def flush(self) -> None:
        """Hand everything logged to the operating system."""
        for writer in self._writers:
            writer.flush()

    def close(self) -> None:
        """Write what is left and close the files."""
        for writer in self._writers:
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


def _layout() -> dict[str, dict[str, list[Any]]]:
    """Charts of the Custom Scalars tab: the median over the runs within its quartiles."""
    return {
        "over runs": {
            tag: ["Margin", [f"{tag}/median", f"{tag}/q25", f"{tag}/q75"]] for tag in _BANDS
        }
    }


def _table(config: EvolveConfig) -> str:
    """The options as a Markdown table."""
    rows = [f"| {name} | {value} |" for name, value in dataclasses.asdict(config).items()]
    return "\n".join(["| option | value |", "|---|---|", *rows])
