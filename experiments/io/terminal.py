"""What is told on the terminal: results and progress on stdout, warnings by Python's logging."""

from __future__ import annotations

import contextlib
import importlib
import logging
import os
import sys
from collections.abc import Iterator
from pathlib import Path

__all__ = ["LOG", "is_interactive", "is_told", "quiet", "say", "show_in_notebook"]

LOG = logging.getLogger("hebbtorch")
"""Warnings, and what failed without ending the command."""


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Tell nothing but warnings and errors within this context."""
    with open(os.devnull, "w") as nowhere, contextlib.redirect_stdout(nowhere):
        yield


def is_told() -> bool:
    """Whether anything is told at all."""
    return sys.stdout is not None and getattr(sys.stdout, "name", "") != os.devnull


def is_interactive() -> bool:
    """Whether lines can be replaced: on a terminal, not in a log file or a notebook."""
    return is_told() and sys.stdout.isatty()


def say(text: str) -> None:
    """Print a line at once, unless told to be quiet."""
    if is_told():
        print(text, flush=True)


def show_in_notebook(path: Path) -> None:
    """Show a GIF below the cell, if this runs in a notebook; elsewhere do nothing."""
    if path.suffix != ".gif" or "ipykernel" not in sys.modules or not is_told():
        return
    display = importlib.import_module("IPython.display")
    display.display(display.Image(filename=str(path)))
