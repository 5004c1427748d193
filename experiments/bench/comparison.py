"""The speed of this program and of another checkout of it, measured in turns.

Machines are now faster, now slower. So both programs simulate the same robots for the same time,
one after the other, again and again; each pair gives a ratio of CPU times, and their median counts.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from experiments.bench import comparison_worker, rates
from experiments.bench.machine import Machine
from experiments.bench.setting import Setting

__all__ = ["Comparison", "check", "compare", "compare_all", "markdown", "show", "write_json"]

_FORMAT = 1  # of the table in JSON
_HERE = Path(__file__).resolve().parents[2]
_WORKLOAD = Path("experiments", "bench", "workload.py")
_STRETCH = 2  # repetitions' length, so that a switch between processes weighs little
_KINDS = {
    "open": "open loop",
    "hebbian": "closed loop, Hebbian",
    "mlp": "closed loop, static",
    "own": "own torch module",
}
_ROWS = [(kind, shape) for kind in _KINDS for shape in (rates.BIPED, rates.WORM)][:-1]
_HEAD = ("what", "ratio", "quartiles", "n", "there, us", "here, us", "same bits")


@dataclass(frozen=True)
class Comparison:
    """The same work, done by two programs.

    Attributes:
        what: The name of the work that is timed.
        there: CPU time per robot-step of the other checkout [us], one figure per pair.
        here: The times of this program, likewise.
        same_bits: whether all robots ended in the same poses, bit for bit.
    """

    what: str
    there: tuple[float, ...]
    here: tuple[float, ...]
    same_bits: bool

    @property
    def ratios(self) -> list[float]:
        """Of each pair, how many times as fast this program is."""
        return [there / here for there, here in zip(self.there, self.here, strict=True)]

    @property
    def ratio(self) -> float:
        """The median, which counts."""
        return statistics.median(self.ratios)

    @property
    def quartiles(self) -> tuple[float, float]:
        """Lower and upper."""
        if len(self.there) == 1:
            return self.ratio, self.ratio
        low, _, high = statistics.quantiles(self.ratios, n=4, method="inclusive")
        return low, high


class _Worker:
    """A process with the code of one checkout; a context manager that ends it."""

    def __init__(self, checkout: Path, kind: str, shape: str, setting: Setting) -> None:
        self._checkout = checkout
        work = [kind, shape, str(setting.worlds), str(setting.seed)]
        self._process = subprocess.Popen(
            [sys.executable, "-P", comparison_worker.__file__, str(checkout), *work],
            env={**os.environ, "PYTHONPATH": str(checkout), "OMP_NUM_THREADS": "1"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def __enter__(self) -> _Worker:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.communicate()

    def wait(self) -> None:
        """Until it can begin.

        Raises:
            ValueError: the checkout has no such robots.
        """
        if (answer := self._answer()) != "ready":
            raise ValueError(
                f"against: expected a checkout of hebbtorch that can run, got {self._checkout} "
                f"({answer})"
            )

    def live(self, steps: int) -> tuple[float, str]:
        """CPU time of some steps [s], and a digest of the poses after them."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{steps}\n")
        self._process.stdin.flush()
        seconds, digest = self._answer()
        return seconds, digest

    def _answer(self) -> Any:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        return json.loads(line) if line else f"ended with code {self._process.wait()}"


def check(checkout: Path) -> None:
    """Looks for the other program.

    Raises:
        ValueError: it is not there.
    """
    if not (checkout / _WORKLOAD).is_file():
        raise ValueError(
            f"against: expected a checkout of hebbtorch with {_WORKLOAD}, got {checkout}; "
            f"`git worktree add DIR COMMIT` makes one"
        )


def compare(checkout: Path, setting: Setting, kind: str, shape: str) -> Comparison:
    """One kind of work, done by the program in a checkout and by this one.

    Args:
        checkout: folder of the other program, as `git worktree add` or `git clone` makes it.
        setting: How much is measured.
        kind: "open", "hebbian", "mlp" or "own".
        shape: The shape of the robots.

    Raises:
        ValueError: the folder holds no such program.
    """
    steps = _STRETCH * setting.steps
    times: tuple[list[float], list[float]] = ([], [])
    with ExitStack() as stack:
        both = [
            stack.enter_context(_Worker(folder, kind, shape, setting))
            for folder in (checkout.resolve(), _HERE)
        ]
        for each in both:
            each.wait()
        same = len({each.live(setting.warm_up)[1] for each in both}) == 1
        for pair in range(setting.pairs):
            digests = set()
            for number in (0, 1) if pair % 2 == 0 else (1, 0):
                seconds, digest = both[number].live(steps)
                times[number].append(1e6 * seconds / (steps * setting.worlds))
                digests.add(digest)
            same = same and len(digests) == 1
    what = f"{_KINDS[kind]}, {shape}, {setting.worlds} worlds"
    return Comparison(what, tuple(times[0]), tuple(times[1]), same)


def compare_all(console: Console, checkout: Path, setting: Setting) -> list[Comparison]:
    """All kinds of work, one after the other; tells how far it is.

    Raises:
        ValueError: the folder holds no such program.
    """
    rows = []
    for kind, shape in _ROWS:
        rows.append(compare(checkout, setting, kind, shape))
        console.print(f"{len(rows)}/{len(_ROWS)} {rows[-1].what}: x {rows[-1].ratio:.3f}")
    return rows


def show(console: Console, checkout: Path, rows: Sequence[Comparison]) -> None:
    """Prints the table."""
    table = Table(title=f"CPU time of {checkout} over that of this program", title_justify="left")
    for number, name in enumerate(_HEAD):
        table.add_column(name, justify="right" if number else "left", no_wrap=number > 0)
    for row in rows:
        table.add_row(*_cells(row))
    console.print(table)


def markdown(machine: Machine, checkout: Path, rows: Sequence[Comparison]) -> str:
    """The table as Markdown."""
    lines = [f"{checkout} and this program in turns; {machine.cpu}, {machine.date}", ""]
    cells = [_HEAD, ("---", *["--:"] * (len(_HEAD) - 1)), *map(_cells, rows)]
    return "\n".join([*lines, *(f"| {' | '.join(line)} |" for line in cells)]) + "\n"


def write_json(
    path: Path, machine: Machine, checkout: Path, seed: int, rows: Sequence[Comparison]
) -> None:
    """Writes everything for a machine to read."""
    content = {
        "format": _FORMAT,
        "machine": machine.as_dict(),
        "against": str(checkout.resolve()),
        "seed": seed,
        "rows": [
            {
                "what": row.what,
                "ratio": row.ratio,
                "quartiles": row.quartiles,
                "there": row.there,
                "here": row.here,
                "same_bits": row.same_bits,
            }
            for row in rows
        ],
    }
    path.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def _cells(row: Comparison) -> tuple[str, ...]:
    low, high = row.quartiles
    there, here = statistics.median(row.there), statistics.median(row.here)
    ratio = (f"{row.ratio:.3f}", f"{low:.3f} - {high:.3f}", str(len(row.there)))
    return row.what, *ratio, f"{there:.3f}", f"{here:.3f}", "yes" if row.same_bits else "NO"
