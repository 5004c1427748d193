"""What the terminal shows while something takes its time."""

from __future__ import annotations

import math
import statistics
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from experiments.io import terminal
from experiments.runs.history import HistoryRow

__all__ = ["ProgressDisplay", "counted"]

_INTERVAL = 5.0  # between plain lines [s]
_WINDOW = 10  # generations from which the time left is estimated
_COMPILING = "compiling the simulator (5 to 15 s the first time)"


class ProgressDisplay:
    """A live line on a terminal; elsewhere a plain line now and then.

    With several runs, it shows the best of them and the median of their medians. The time left
    follows from the last generations; the first one, which compiles, does not count.
    """

    _compiled = (
        False  # whether a generation was shown in this process, so that the kernels are there
    )

    def __init__(
        self,
        generations: int,
        done: int,
        *,
        label: str = "",
        interval: float = _INTERVAL,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Start to show progress.

        Args:
            generations: The number of generations of the whole evolution.
            done: How many of them were done before this process.
            label: The label of every line, short.
            interval: between plain lines [s].
            clock: tells the time [s].
        """
        self._label = f"{label}  " if label else ""
        self._interval = interval
        self._generations = generations
        self._clock = clock
        self._ends: deque[tuple[int, float]] = deque(maxlen=_WINDOW + 1)
        self._last_line = -math.inf
        self._live: Progress | None = None
        if done >= generations or not terminal.is_told():
            return
        if terminal.is_interactive():
            self._live = Progress(
                TextColumn(self._label + "generation {task.completed}/{task.total}", markup=False),
                BarColumn(bar_width=10),
                TextColumn("{task.description}", markup=False),
                console=Console(),
            )
            self._task = self._live.add_task(
                "" if ProgressDisplay._compiled else _COMPILING, total=generations, completed=done
            )
            self._live.start()
        elif not ProgressDisplay._compiled:
            terminal.say(f"{self._label}{_COMPILING}")

    def show(self, rows: Sequence[HistoryRow], evaluations_per_second: float) -> None:
        """Show one generation: a row for each run."""
        ProgressDisplay._compiled = True
        generation, now = rows[0].generation, self._clock()
        self._ends.append((generation, now))
        best = max((row.best for row in rows if not math.isnan(row.best)), default=math.nan)
        median = statistics.median(row.median for row in rows)
        words = [f"best {best:.2f}", f"median {median:.2f} m/s"]
        if (left := self._seconds_left()) is not None:
            words += [f"{evaluations_per_second:.0f}/s", f"{_clock_time(left)} left"]
        text = "  ".join(words)
        if self._live is not None:
            self._live.update(self._task, completed=generation, description=text)
        elif now - self._last_line >= self._interval or generation == self._generations:
            self._last_line = now
            terminal.say(f"{self._label}generation {generation}/{self._generations}  {text}")

    def _seconds_left(self) -> float | None:
        """Estimate from the last generations; None before there are two ends of generations."""
        (first, began), (last, ended) = self._ends[0], self._ends[-1]
        if last == first:
            return None
        return (ended - began) / (last - first) * (self._generations - last)

    def close(self) -> None:
        """Leave the terminal as it was."""
        if self._live is not None:
            self._live.stop()

    def __enter__(self) -> ProgressDisplay:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()


@contextmanager
def counted(what: str) -> Iterator[Callable[[int, int], None]]:
    """Show how many of something are done.

    Args:
        what: such as "picture".

    Yields:
        A function to be called with the number done and the number in all.
    """
    if not terminal.is_told():
        yield lambda done, total: None
    elif terminal.is_interactive():
        words = TextColumn(f"{what} {{task.completed}}/{{task.total}}", markup=False)
        with Progress(words, BarColumn(bar_width=30), console=Console(), transient=True) as live:
            task = live.add_task(what, total=None)
            yield lambda done, total: live.update(task, completed=done, total=total)
    else:
        last = time.monotonic()

        def tell(done: int, total: int) -> None:
            nonlocal last
            if time.monotonic() - last >= _INTERVAL:
                last = time.monotonic()
                terminal.say(f"{what} {done}/{total}")

        yield tell


def _clock_time(seconds: float) -> str:
    """Such as 0:07, 12:30 or 3:05:00."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
