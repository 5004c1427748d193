"""Processes that stop dead at a chosen generation, so that a test kills them exactly there.

A test that watches a file and kills when it looks right depends on which of the two is faster.
Here the process itself says that it has arrived, through a pipe with a name, and goes no further;
the test waits for that or for the end of the process, whichever comes, without looking at a clock.
"""

from __future__ import annotations

import fcntl
import os
import select
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from experiments.runs.folder import Checkpoint, RunStore

ROOT = Path(__file__).parents[2]
COMMAND = [sys.executable, "-c", "from experiments.cli import main; main()"]
HELD = """
import sys
from experiments.cli import main
from tests.experiments.held import hold_as

hold_as([sys.argv.pop(1) for _ in range(4)])
main()
"""


def hold_as(arguments: Sequence[str]) -> None:
    """`hold`, as a command line gives it: pipe, name, generation, moment."""
    pipe, name, generation, moment = arguments
    signal.signal(signal.SIGINT, signal.default_int_handler)  # background jobs of shells ignore it
    hold(Path(pipe), name, int(generation), moment)


def hold(pipe: Path, name: str, generation: int, moment: str) -> None:
    """From now on, a run of this process does not get past a generation.

    Args:
        pipe: to tell that it has arrived.
        name: of the run's folder.
        generation: to stop at.
        moment: "before" its checkpoint is written, or "after".
    """
    save = RunStore.save

    def save_and_stop(self: RunStore, checkpoint: Checkpoint) -> None:
        here = self.folder.name == name and checkpoint.generation == generation
        if here and moment == "before":
            _stop(pipe)
        save(self, checkpoint)
        if here:
            _stop(pipe)

    RunStore.save = save_and_stop  # type: ignore[method-assign]


def _stop(pipe: Path) -> None:
    pipe.write_text("here\n")
    threading.Event().wait()  # for a signal


@contextmanager
def held(
    arguments: str,
    folder: Path,
    generation: int,
    *,
    moment: str = "after",
    code: str = HELD,
) -> Iterator[subprocess.Popen[str]]:
    """`hebbtorch <arguments>`, stopped in a generation of the run in `folder`.

    It is killed at the end, if it is still there; nothing is left running.
    """
    place = tempfile.TemporaryDirectory()
    pipe = Path(place.name, "pipe")
    os.mkfifo(pipe)
    listening = os.open(pipe, os.O_RDWR | os.O_NONBLOCK)  # so that opening waits for no writer
    command = [sys.executable, "-c", code, str(pipe), folder.name, str(generation), moment]
    command += arguments.split()
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    )
    try:
        wait_for(listening, process)
        yield process
    finally:
        process.kill()
        process.communicate()
        os.close(listening)
        place.cleanup()


def wait_for(listening: int, process: subprocess.Popen[str]) -> None:
    """Wait until a process says that it has arrived.

    Raises:
        AssertionError: it ended before.
    """
    end = os.pidfd_open(process.pid)
    try:
        ready, _, _ = select.select([listening, end], [], [])
    finally:
        os.close(end)
    assert listening in ready, f"ended before: {process.communicate()}"


def interrupt(process: subprocess.Popen[str], number: int = signal.SIGINT) -> tuple[str, str]:
    """Send a signal and wait for the end; what the process wrote to stdout and stderr."""
    process.send_signal(number)
    out, err = process.communicate()
    return out, err


def wait_for_lock(folder: Path) -> None:
    """Wait until no process works in a folder."""
    with (folder / "lock").open("a") as file:
        fcntl.flock(file, fcntl.LOCK_EX)


def lines(folder: Path) -> Sequence[str]:
    """Of history.csv."""
    return (folder / "history.csv").read_text().splitlines()
