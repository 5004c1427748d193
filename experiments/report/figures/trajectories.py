"""Figures of recorded trajectories: the way, the commands, the contacts and the readings."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from experiments.analysis import trajectory_file
from experiments.analysis.trajectory import Trajectory
from experiments.io.style import Sheet, sheet

__all__ = ["draw_trajectories"]

_PANEL = 5.0, 1.3  # [in]


def draw_trajectories(files: Sequence[Path], out: Path | None) -> list[Path]:
    """Draw a figure of each, `NAME.png` and `.pdf`.

    Args:
        files: that `hebbtorch record` or `trajectory_file.save` wrote.
        out: folder for the figures, created if need be; by default that of the first file.

    Returns:
        The files written.

    Raises:
        ValueError: one cannot be read; nothing was written then.
    """
    courses = {file.stem: trajectory_file.load(file) for file in files}
    folder = files[0].parent if out is None else out
    folder.mkdir(parents=True, exist_ok=True)
    written: list[Path] = []
    for name, course in courses.items():
        with sheet(folder, name, _PANEL, rows=4, sharex="col") as page:
            _draw(page, course)
        written += page.files
    return written


def _draw(page: Sheet, course: Trajectory) -> None:
    """The four panels of one trajectory over the same time."""
    times = course.times
    ends = float(times[0]), float(times[-1])
    way = page.panel(0)
    way.plot(times, course.centers[:, 0] - course.centers[0, 0])
    way.set(ylabel="way [m]", title=course.title)
    tables = [
        ("actuation", course.actuation, "PuOr", -1.0, 1.0),
        ("touching", course.touching.astype(float), "Greys", 0.0, 1.0),
        ("readings", course.readings, "viridis", 0.0, 1.0),
    ]
    for row, (name, values, colours, low, high) in enumerate(tables, start=1):
        panel = page.panel(row)
        rows = values.shape[1] if values.ndim == 2 else 0
        image = panel.imshow(
            np.nan_to_num(values.T) if rows else np.zeros((1, len(times))),
            aspect="auto",
            origin="lower",
            interpolation="nearest",
            extent=(*ends, -0.5, max(rows, 1) - 0.5),
            cmap=colours,
            vmin=low,
            vmax=high,
        )
        panel.set(ylabel=f"{name}\n(number)")
        page.figure.colorbar(image, ax=panel)
    page.panel(3).set(xlabel="time [s]")
    page.note(
        "Way of the centre; actuation of the voxels, 1 contracts; which voxels touch the ground; "
        "readings of the sensors."
    )
