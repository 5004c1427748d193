"""Reading results that something may have damaged: every error names the file."""

from __future__ import annotations

import csv
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

__all__ = ["readable"]

_ERRORS = (
    *(OSError, ValueError, LookupError, TypeError, AttributeError, EOFError, RecursionError),
    *(csv.Error, zipfile.BadZipFile, zlib.error),
)


@contextmanager
def readable(path: Path) -> Iterator[None]:
    """Turn whatever a damaged file makes its readers raise into one clear line.

    Args:
        path: The file that is read meanwhile.

    Raises:
        ValueError: It cannot be read.
    """
    try:
        yield
    except _ERRORS as error:
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise ValueError(
            f"table: cannot read {str(path)!r} ({reason}); remove it, and let the command that "
            "wrote it write it again"
        ) from error
