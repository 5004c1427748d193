"""What is told on the terminal: results and progress on stdout, warnings by Python's logging."""

from __future__ import annotations

import logging
import sys

__all__ = ["LOG", "be_quiet", "is_interactive", "is_told", "say"]

LOG = logging.getLogger("hebbtorch")
"""Warnings, and what failed without ending the command."""

_quiet = False


def be_quiet(quiet: bool = True) -> None:
    """Tell nothing but warnings and errors from now on."""
    global _quiet
    _quiet = quiet


def is_told() -> bool:
    """Whether anything is told at all."""
    return not _quiet and sys.stdout is not None


def is_interactive() -> bool:
    """Whether lines can be replaced: on a terminal, not in a log file or a notebook."""
    return is_told() and sys.stdout.isatty()


def say(text: str) -> None:
    """Print a line at once, unless told to be quiet."""
    if is_told():
        print(text, flush=True)
