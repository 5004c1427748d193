"""`hebbtorch figures`: all figures that finished runs allow, and the report on the claims."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

from experiments.io.outputs import require_folder
from experiments.report import claims, intervals, tables
from experiments.report.bundle import unpacked
from experiments.report.conditions import CAPTION, condition_rows
from experiments.report.figures import FIGURES
from experiments.report.figures.trajectories import draw_trajectories
from experiments.report.finished_runs import find_runs, gather

__all__ = ["draw_all"]


def draw_all(
    roots: Sequence[Path], out: Path | None, seed: int, *, all_formats: bool = True
) -> list[str]:
    """Draw every figure, write its table and the report, and tell which files were written.

    Args:
        roots: folders with finished runs at or below them, or packed campaigns; or files with
            recorded trajectories, of which each gets a figure of its own.
        out: folder for the files, created if need be; by default `figures` in the first root.
        seed: The seed of the bootstrap intervals.
        all_formats: whether to keep figures in PDF and tables in Markdown, too.

    Returns:
        Names of the figures that were not drawn, since runs for them are missing.

    Raises:
        ValueError: there is no finished run, one cannot be read, or they are of different scales;
            nothing was written then.
    """
    if not roots:
        raise ValueError("root: expected a folder with finished runs, got none; name it")
    if all(root.is_file() for root in roots):
        for path in draw_trajectories(roots, out):
            print(f"wrote {path}")
        return []
    if missing := [root for root in roots if not root.is_dir()]:
        raise ValueError(f"root: expected an existing folder, got {str(missing[0])!r}")
    out = out or roots[0] / "figures"
    require_folder(out)
    with unpacked(roots) as folders:
        found = find_runs(folders)
        if not found:
            raise ValueError(
                f"root: expected finished runs at or below {', '.join(map(repr, map(str, roots)))},"
                f" found none; `hebbtorch campaign paper --out {roots[0]}` makes them"
            )
        gather(found)  # so that what is wrong with them is told before anything is written
        out.mkdir(parents=True, exist_ok=True)
        with intervals.resampling_with(seed):
            return _draw(found, out, all_formats)


def _draw(found: Sequence[Path], out: Path, all_formats: bool) -> list[str]:
    """Draw everything beside `out`'s files, and put it among them once all of it is there."""
    undrawn = []
    with tempfile.TemporaryDirectory(prefix=".drawing-", dir=out) as draft:
        for name, figure in FIGURES.items():
            files = figure(found, Path(draft))
            _keep(files, all_formats)
            if not files:
                undrawn.append(name)
        rows = condition_rows(gather(found))
        _keep(tables.write(rows, Path(draft), "conditions", CAPTION), all_formats)
        claims.write_summary(found, Path(draft))
        for path in sorted(Path(draft).iterdir()):
            os.replace(path, out / path.name)
            print(f"wrote {out / path.name}")
    return undrawn


def _keep(files: Sequence[Path], all_formats: bool) -> None:
    """Delete the PDF and Markdown among files, unless all formats are wanted."""
    for path in files:
        if path.suffix in (".pdf", ".md") and not all_formats:
            path.unlink()
