"""What comes after the conditions of a study: analyses of each run's folder, then figures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

__all__ = ["analyse", "draw"]


def analyse(name: str, folder: Path) -> Path:
    """Apply an analysis to a finished run; what is there already is left alone.

    Args:
        name: The name of a function of `experiments.analysis.registry`.
        folder: The folder of the run.

    Returns:
        The file.
    """
    from experiments.analysis import registry

    path: Path = getattr(registry, name)(folder)
    return path


def draw(name: str, folders: Sequence[Path], out: Path) -> list[Path]:
    """Draw a figure, with its table.

    Args:
        name: The name of a function of `experiments.report.figures`.
        folders: The folders of all runs of a study, finished and analysed.
        out: folder for the files, created if need be.

    Returns:
        The files.
    """
    from experiments.report.figures import FIGURES

    out.mkdir(parents=True, exist_ok=True)
    return FIGURES[name](folders, out)
