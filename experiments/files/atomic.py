"""Files that are replaced in one instant: a reader sees the old content or the new one."""

from __future__ import annotations

import os
from pathlib import Path

__all__ = ["write_atomically"]


def write_atomically(path: Path, content: bytes) -> None:
    """Replace a file by new content; it is never seen half written, not even after a crash.

    Args:
        path: The file, in an existing folder.
        content: What it shall hold.
    """
    temporary = path.with_name(path.name + ".tmp")
    with temporary.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    os.replace(temporary, path)
