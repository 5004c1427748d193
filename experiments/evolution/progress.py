"""What the terminal shows while an evolution runs."""

from __future__ import annotations

import math
import statistics
import sys
import time
from collections.abc import Sequence

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from experiments.runs.history import Row

__all__ = ["ProgressDisplay"]

_INTERVAL = 5.0  # between plain lines [s]


class ProgressDisplay:
    """A live line on a terminal; elsewhere a plain line now and then.

    With several runs, it shows the best of them and the median of their medians.
    """

    def __init__(
        self, generations: int, done: int, *, label: str = "", interval: float = _INTERVAL
    ) -> None:
        """Start to show progress.

        Args:
            generations: of the whole evolution.
            done: of them, done before this process.
            label: of every line.
            interval: between plain lines [s].
        """
        self._label = f"{label}  " if label else ""
        self._interval = interval
        self._generations = generations
        self._first = done
        self._started = time.monotonic()
        self._last_line = -interval
        self._live: Progress | None = None
        if sys.stdout is not None and sys.stdout.isatty():
            self._live = Progress(
                TextColumn(self._label + "generation {task.completed}/{task.total}", markup=False),
                BarColumn(),
                TextColumn("{task.description}"),
                TimeRemainingColumn(),
                TextColumn("left"),
                console=Console(),
            )
            self._task = self._live.add_task("", total=generations, completed=done)
            self._live.start()

    def show(self, rows: Sequence[Row], evaluations_per_second: float) -> None:
        """Show one generation: a row for each run."""
        generation = rows[0].generation
        best = max((row.best for row in rows if not math.isnan(row.best)), default=math.nan)
        median = statistics.median(row.median for row in rows)
        text = (
            f"best {best:.2f} m/s  median {median:.2f} m/s  "
            f"{evaluations_per_second:.0f} evaluations/s"
        )
        if self._live is not None:
            self._live.update(self._task, completed=generation, description=text)
            return
        now = time.monotonic() - self._started
        if now - self._last_line >= self._interval or generation == self._generations:
            self._last_line = now
            left = now / (generation - self._first) * (self._generations - generation)
            line = f"generation {generation}/{self._generations}  {text}  {left:.0f} s left"
            print(self._label + line, flush=True)

    def close(self) -> None:
        """Leave the terminal as it was."""
        if self._live is not None:
            self._live.stop()

    def __enter__(self) -> ProgressDisplay:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()
