"""`hebbtorch report`: writes the page of a run or a campaign."""

from __future__ import annotations

from pathlib import Path

from experiments.io import terminal
from experiments.io.atomic import write_atomically
from experiments.io.outputs import require_folder
from experiments.runs.names import CHAMPIONS, CONFIG

__all__ = ["write_page"]


def write_page(folder: Path, out: Path | None = None, seed: int = 0) -> Path:
    """Write one HTML file about a run or a campaign.

    Args:
        folder: The folder of a finished run, or of a campaign; or a file with a recorded
            trajectory.
        out: the file; by default report.html in the folder, or beside the file.
        seed: The seed of terrain, noise and damage of the episodes shown.

    Returns:
        The file.

    Raises:
        ValueError: there is no finished run, or the file cannot be put there; nothing was written.
    """
    if not folder.exists():
        raise ValueError(
            f"run: expected the folder of a run or a campaign, or a trajectory, got {str(folder)!r}"
        )
    out = out or (folder if folder.is_dir() else folder.parent) / "report.html"
    if out.suffix != ".html" or out.is_dir() or not out.parent.is_dir():
        raise ValueError(
            f"out: expected a name ending in .html in an existing folder, got {str(out)!r}"
        )
    require_folder(out.parent)
    is_run = (folder / CONFIG).is_file() or (folder / CHAMPIONS).is_file()
    if folder.is_file():
        from experiments.report.page.trajectory_page import trajectory_page

        content = trajectory_page(folder)
    elif is_run:
        from experiments.report.page.run_page import run_page

        content = run_page(folder, seed)
    else:
        from experiments.report.page.campaign_page import campaign_page

        content = campaign_page(folder, seed)
    write_atomically(out, content.encode())
    terminal.say(f"wrote {out}; open it in a browser, no network is needed")
    return out
