"""Where Taichi keeps compiled kernels, if there is any place for them.

Taichi keeps them below HOME, ends the process if there is none, and crashes at exit if it cannot
write there. In containers and under service managers both happen.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

__all__ = ["cache_folder", "some_home"]

_FOLDER = "TI_OFFLINE_CACHE_FILE_PATH"  # Taichi's own variable, which goes before an argument


def cache_folder() -> Path:
    """A folder for compiled kernels that can be written: Taichi's own, or a temporary one.

    Raises:
        OSError: there is no place where this process can write.
    """
    chosen = os.environ.get(_FOLDER)
    home = os.environ.get("HOME")
    candidates = [Path(chosen)] if chosen else []
    candidates += [Path(home, ".cache", "taichi", "ticache")] if home else []
    for folder in candidates:
        if _writable(folder):
            return folder
    mine = Path(tempfile.gettempdir(), f"hebbtorch-taichi-{os.getuid()}")
    # A folder of that name that somebody else made may hold anybody's code.
    if _writable(mine) and mine.lstat().st_uid == os.getuid() and not mine.is_symlink():
        return mine
    return Path(tempfile.mkdtemp(prefix="hebbtorch-taichi-"))


def _writable(folder: Path) -> bool:
    """Whether files can be made there; the folder is created if need be."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


@contextmanager
def some_home(folder: Path | None = None) -> Iterator[None]:
    """Lets Taichi find a HOME, and the folder of the cache, while it looks for them.

    Args:
        folder: The folder of the cache.
    """
    changed = {} if os.environ.get("HOME") else {"HOME": tempfile.gettempdir()}
    if folder is not None:
        changed[_FOLDER] = str(folder)
    before = {name: os.environ.get(name) for name in changed}
    os.environ.update(changed)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
