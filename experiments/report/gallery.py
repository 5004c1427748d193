"""`hebbtorch figures`: all figures that finished runs allow, and the report on the claims."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

from experiments.report import claims, intervals
from experiments.report.bundle import unpacked
from experiments.report.figures import FIGURES
from experiments.report.finished_runs import find_runs, gather

__all__ = ["draw_all"]


def draw_all(
    roots: Sequence[Path], out: Path | None, seed: int, *, print_quality: bool = True
) -> list[str]:
    """Draw every figure, write its table and the report, and tell which files were written.

    Args:
        roots: folders with finished runs at or below them, or packed campaigns.
        out: folder for the files, created if need be; by default `figures` in the first root.
        seed: The seed of the bootstrap intervals.
        print_quality: whether to keep the figures in PDF, too.

    Returns:
        Names of the figures that were not drawn, since runs for them are missing.

    Raises:
        ValueError: there is no finished run, one cannot be read, or they are of different scales;
            nothing was written then.
    """
    if not roots:
        raise ValueError("root: expected a folder with finished runs, got none; name it")
    if missing := [root for root in roots if not root.is_dir()]:
        raise ValueError(f"root: expected an existing folder, got {str(missing[0])!r}")
    with unpacked(roots) as folders:
        found = find_runs(folders)
        if not found:
            raise ValueError(
                f"root: expected finished runs at or below {', '.join(map(repr, map(str, roots)))},"
                f" found none; `hebbtorch campaign paper --out {roots[0]}` makes them"
            )
        gather(found)  # so that what is wrong with them is told before anything is written
        out = out or roots[0] / "figures"
        out.mkdir(parents=True, exist_ok=True)
        with intervals.resampling_with(seed):
            return _draw(found, out, print_quality)


def _draw(found: Sequence[Path], out: Path, print_quality: bool) -> list[str]:
    """Draw everything beside `out`'s files, and put it among them once all of it is there."""
    undrawn = []
    with tempfile.TemporaryDirectory(prefix=".drawing-", dir=out) as draft:
        for name, figure in FIGURES.items():
            files = figure(found, Path(draft))
            for path in files:
                if path.suffix == ".pdf" and not print_quality:
                    path.unlink()
            if not files:
                undrawn.append(name)
        claims.write_summary(found, Path(draft))
        for path in sorted(Path(draft).iterdir()):
            os.replace(path, out / path.name)
            print(f"wrote {out / path.name}")
    return undrawn
