"""Format numbers: every file that is read again says in which format it is written."""

from __future__ import annotations

from typing import Any

__all__ = ["require_format"]


def require_format(found: Any, known: int) -> None:
    """Refuse a file in another format than this version writes.

    Args:
        found: The number in the file.
        known: The one that this version reads.

    Raises:
        ValueError: they differ.
    """
    if isinstance(found, str) and found.isdecimal():
        found = int(found)
    if isinstance(found, bool) or not isinstance(found, int) or found < 1:
        raise ValueError(f"format: expected {known}, got {found!r}")
    if found > known:
        raise ValueError(
            f"format: expected at most {known}, got {found}, which a newer version of hebbtorch "
            "has written; use that version"
        )
    if found != known:
        raise ValueError(f"format: expected {known}, got {found}")
