"""One TensorBoard run: scalars, histograms, pictures, texts and options in an event file."""

from __future__ import annotations

import io
import re
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from tensorboard.compat.proto.summary_pb2 import HistogramProto, Summary
from torch.utils.tensorboard import SummaryWriter
from torch.utils.tensorboard.summary import hparams

__all__ = ["EventFile"]

_NAME = re.compile(r"events\.out\.tfevents\.(\d+)(\..*)")
_BINS = 30  # of a histogram
_RGB = 3


class EventFile:
    """Writes what one run of TensorBoard shows.

    Its step means the same for all that is written: generations, or seconds of an episode.
    """

    def __init__(self, folder: Path, first_step: int | None = None, part: str = "") -> None:
        """Open a new file in a folder.

        Args:
            folder: The folder of the TensorBoard run, created if need be.
            first_step: Nothing that older files logged for this step and later ones is shown; None:
                all of it stays.
            part: names what the file holds; older files of the same part are replaced.
        """
        if part:
            for old in folder.glob(f"events.out.tfevents.*.{part}"):
                old.unlink()
        _make_way_for_new_names(folder)
        suffix = f".{part}" if part else ""
        self._writer = SummaryWriter(str(folder), purge_step=first_step, filename_suffix=suffix)

    def scalars(self, values: Mapping[str, float | None], step: int) -> None:
        """Write numbers by their tags; None is passed over."""
        self._add(
            [
                Summary.Value(tag=tag, simple_value=value)
                for tag, value in values.items()
                if value is not None
            ],
            step,
        )

    def histogram(self, tag: str, values: np.ndarray, step: int) -> None:
        """Write how numbers are distributed; of those that are not finite, nothing is shown."""
        finite = np.asarray(values, dtype=np.float64).ravel()
        finite = finite[np.isfinite(finite)]
        if not finite.size:
            return
        counts, edges = np.histogram(finite, _BINS)
        proto = HistogramProto(
            min=finite.min(),
            max=finite.max(),
            num=finite.size,
            sum=finite.sum(),
            sum_squares=np.square(finite).sum(),
            bucket_limit=[edges[0], *edges[1:]],
            bucket=[0, *counts],
        )
        self._add([Summary.Value(tag=tag, histo=proto)], step)

    def image(self, tag: str, image: Image.Image, step: int) -> None:
        """Write a picture."""
        content = io.BytesIO()
        image.save(content, "PNG")
        self._encoded(tag, content.getvalue(), image.size, step)

    def picture_file(self, tag: str, path: Path, step: int) -> None:
        """Write the content of a PNG or GIF file; a GIF stays animated."""
        with Image.open(path) as image:
            size = image.size
        self._encoded(tag, path.read_bytes(), size, step)

    def text(self, tag: str, markdown: str, step: int = 0) -> None:
        """Write a text."""
        self._writer.add_text(tag, markdown, step)

    def bands(self, charts: Mapping[str, Sequence[str]], title: str) -> None:
        """Declare charts of a median within its quartiles, for the Custom Scalars tab.

        Args:
            charts: Name of each chart -> its three tags: median, lower and upper end of the band.
            title: The title of all charts.
        """
        layout: dict[str, Any] = {name: ["Margin", list(tags)] for name, tags in charts.items()}
        self._writer.add_custom_scalars({title: layout})

    def options(self, options: Mapping[str, Any], metrics: Sequence[str]) -> None:
        """Declare the options of a run and the tags by which the HParams tab compares runs."""
        known = {
            name: value if type(value) in (int, float, str) else str(value)
            for name, value in options.items()
        }
        experiment, begin, _ = hparams(known, dict.fromkeys(metrics, 0.0))
        for summary in (experiment, begin):
            self._summary(summary, 0)

    def ended(self, step: int) -> None:
        """Tell the HParams tab that the run has reached its end."""
        *_, end = hparams({"": 0}, {"": 0.0})
        self._summary(end, step)

    def flush(self) -> None:
        """Hand everything to the operating system."""
        self._writer.flush()

    def close(self) -> None:
        """Write what is left and close the file."""
        self._writer.close()

    def __enter__(self) -> EventFile:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def _encoded(self, tag: str, content: bytes, size: tuple[int, int], step: int) -> None:
        width, height = size
        image = Summary.Image(
            width=width, height=height, colorspace=_RGB, encoded_image_string=content
        )
        self._add([Summary.Value(tag=tag, image=image)], step)

    def _add(self, values: list[Any], step: int) -> None:
        """One event for many values: a file with an event for each is several times slower."""
        if values:
            self._summary(Summary(value=values), step)

    def _summary(self, summary: Any, step: int) -> None:
        writer: Any = self._writer.file_writer
        writer.add_summary(summary, step)


def _make_way_for_new_names(folder: Path) -> None:
    """Sees that the next event file is read after those that are there.

    TensorBoard reads event files in the order of their names, which begin with the second of their
    creation. A run that was resumed within that second would be read in disorder, and so would one
    whose clock was set back since, or that goes on on a machine that is behind: files from the
    future get names from before now, in their order.
    """
    found = [(match, path) for path in folder.glob("*") if (match := _NAME.match(path.name))]
    latest = max((int(match[1]) for match, _ in found), default=0)
    time.sleep(min(max(0.0, latest + 1 - time.time()), 1.0))
    now = int(time.time())
    if latest < now:
        return
    order = sorted(found, key=lambda each: each[1].name)
    for age, (match, path) in zip(range(len(order), 0, -1), order, strict=True):
        path.rename(path.with_name(f"events.out.tfevents.{now - age:010d}{match[2]}"))
