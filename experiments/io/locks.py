"""Folders that one process at a time writes into."""

from __future__ import annotations

import fcntl
from pathlib import Path
from typing import IO

__all__ = ["LOCK", "lock_folder"]

LOCK = "lock"
"""Name of the file that the process holds."""


def lock_folder(folder: Path) -> IO[str]:
    """Lock a folder for as long as the file returned is open in this process.

    Args:
        folder: An existing folder.

    Raises:
        ValueError: another process has locked it.
    """
    file = (folder / LOCK).open("a")
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.close()
        raise ValueError(
            f"run: another process is working in {str(folder)!r}; wait until it has finished"
        ) from None
    return file
