"""Files that are replaced in one instant: a reader sees the old content or the new one."""

from __future__ import annotations

import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

__all__ = ["remove_leftovers", "write_atomically"]

_SUFFIX = ".tmp"


def write_atomically(path: Path, content: bytes) -> None:
    """Replace a file by new content; it is never seen half written, not even after a crash.

    Args:
        path: The file, in an existing folder.
        content: What it shall hold.
    """
    temporary = path.with_name(path.name + _SUFFIX)
    try:
        with temporary.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError:  # a full disk keeps no half of it
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        raise


def remove_leftovers(folder: Path, names: Iterable[str]) -> None:
    """Remove what a kill left of files that were being replaced.

    Args:
        folder: Which no other process writes into.
        names: The names of the files.
    """
    for name in names:
        folder.joinpath(name + _SUFFIX).unlink(missing_ok=True)
