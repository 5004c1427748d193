"""Checks of where results are asked for, made before minutes are spent on computing them."""

from __future__ import annotations

from pathlib import Path

__all__ = ["make_room", "require_writable"]


def make_room(file: Path | None, folder: Path | None) -> None:
    """Make the folders that results will be written into.

    Args:
        file: The file of the option --json, if asked for.
        folder: The folder of the option --out, if asked for.

    Raises:
        ValueError: the file is a folder, or the folder a file.
    """
    if file is not None and file.is_dir():
        raise ValueError(f"json: expected a file to write, got the folder {file}")
    if folder is not None and folder.exists() and not folder.is_dir():
        raise ValueError(f"out: expected a folder, got the file {folder}")
    for each in (folder, file and file.parent):
        if each is not None:
            each.mkdir(parents=True, exist_ok=True)


def require_writable(out: Path | None) -> None:
    """Check that a table can be put where it is asked for.

    Args:
        out: The CSV file of the option --out; None if a default will be chosen.

    Raises:
        ValueError: its folder does not exist, or something other than a table is there.
    """
    if out is None:
        return
    if not out.parent.is_dir():
        raise ValueError(f"out: expected a file in an existing folder, got {str(out)!r}; create it")
    if out.is_dir() or (out.exists() and out.suffix != ".csv"):
        raise ValueError(
            f"out: expected a new file or a CSV file, which is replaced, got {str(out)!r}; "
            "choose another name"
        )
