"""How a command behaves as a process: its streams, and the signals that stop it."""

from __future__ import annotations

import io
import os
import signal
import sys
import threading
from types import FrameType
from typing import Any

__all__ = ["Terminated", "prepare"]


class Terminated(KeyboardInterrupt):
    """SIGTERM, as service managers and clusters send it: what Ctrl-C is to a person."""


def prepare() -> None:
    """Make this process last when nobody listens any more, write what its terminal cannot show as
    question marks, and end on SIGTERM as it does on Ctrl-C."""
    if sys.stdout is sys.__stdout__ and isinstance(sys.stdout, io.TextIOWrapper):
        # Both names, or Taichi takes it for a notebook.
        sys.stdout = sys.__stdout__ = _lasting(sys.stdout)  # type: ignore[misc]
    if isinstance(sys.stderr, io.TextIOWrapper):
        sys.stderr.reconfigure(errors="backslashreplace")
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, _terminate)


def _terminate(number: int, frame: FrameType | None) -> None:
    raise Terminated


class _LastingFile(io.FileIO):
    """A file that goes on into nothing once its other end is gone or full: results are in other
    files, and hours of work are not lost for a line of progress."""

    def write(self, data: Any, /) -> int:
        """Write, or pretend to."""
        try:
            return super().write(data)
        except OSError:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self.fileno())
            os.close(nowhere)
            return memoryview(data).nbytes


def _lasting(stream: io.TextIOWrapper) -> io.TextIOWrapper:
    stream.flush()
    file = _LastingFile(stream.fileno(), "w", closefd=False)
    return io.TextIOWrapper(
        io.BufferedWriter(file),
        encoding=stream.encoding,
        errors="replace",
        line_buffering=stream.isatty(),
    )
