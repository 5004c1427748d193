"""Checks of where results are asked for, made before minutes are spent on computing them."""

from __future__ import annotations

import tempfile
from pathlib import Path

__all__ = ["make_room", "require_folder", "require_writable"]


def make_room(file: Path | None, folder: Path | None) -> None:
    """Make the folders that results will be written into.

    Args:
        file: The file of the option --json, if asked for.
        folder: The folder of the option --out, if asked for.

    Raises:
        ValueError: the file is a folder, the folder a file, or one of them cannot be written.
    """
    if file is not None:
        if file.is_dir():
            raise ValueError(f"json: expected a file to write, got the folder {file}")
        require_folder(file.parent, "json")
    if folder is not None:
        require_folder(folder)
    for each in (folder, file and file.parent):
        if each is not None:
            each.mkdir(parents=True, exist_ok=True)


def require_folder(folder: Path, option: str = "out") -> None:
    """Check that files can be put into a folder, which need not exist yet. Nothing stays there.

    Args:
        folder: The folder.
        option: Which asked for it, for the message of an error.

    Raises:
        ValueError: a file has its name or that of a folder above it, or it cannot be written.
    """
    try:
        nearest = next(each for each in (folder, *folder.absolute().parents) if each.exists())
        if nearest.is_dir():
            with tempfile.TemporaryFile(dir=nearest):
                return
    except OSError as error:
        raise ValueError(
            f"{option}: cannot write into {str(folder)!r} ({error.strerror}); choose another place"
        ) from error
    raise ValueError(f"{option}: expected a folder, got the file {nearest}")


def require_writable(out: Path | None, run_folder: Path) -> None:
    """Check that a table can be put where it is asked for.

    Args:
        out: The CSV file of the option --out; None if a default in the run's folder will be chosen.
        run_folder: Folder of the run, if there is one.

    Raises:
        ValueError: its folder does not exist or cannot be written, or something other than a table
            is there.
    """
    if out is None:
        if run_folder.is_dir():
            require_folder(run_folder, "run")
        return
    if not out.parent.is_dir():
        raise ValueError(f"out: expected a file in an existing folder, got {str(out)!r}; create it")
    if out.is_dir() or (out.exists() and out.suffix != ".csv"):
        raise ValueError(
            f"out: expected a new file or a CSV file, which is replaced, got {str(out)!r}; "
            "choose another name"
        )
    require_folder(out.parent)
