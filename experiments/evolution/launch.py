"""`hebbtorch evolve`: an evolution from where it stands to the pictures of its champions."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from experiments.analysis.presentation import present
from experiments.config import EvolveConfig
from experiments.evolution.evolve import Session
from experiments.evolution.progress import ProgressDisplay
from experiments.io import terminal

__all__ = ["evolve", "resume"]


def evolve(config: EvolveConfig, folder: Path) -> None:
    """Run an evolution and leave everything in a new folder.

    Args:
        config: The options of the evolution.
        folder: must not exist yet, or be empty.

    Raises:
        ValueError: an option is wrong, or the folder cannot be used; nothing was written then.
        KeyboardInterrupt: it was stopped; `resume` goes on with it.
    """
    with Session.create(config, folder) as session:
        _run(session)


def resume(
    folder: Path, generations: int | None = None, machine: Mapping[str, Any] | None = None
) -> None:
    """Go on with an evolution exactly as if it had not been stopped.

    Args:
        folder: The folder of the run.
        generations: how many it shall have from now on, as if it had been started with them;
            None: as many as before.
        machine: Options of the machine in place of those the run was begun with.

    Raises:
        ValueError: the folder cannot be used; nothing was changed then.
        KeyboardInterrupt: it was stopped again.
    """
    with Session.resume(folder, generations, machine=machine) as session:
        _run(session)


def _run(session: Session) -> None:
    """Evolve to the last generation, then present the champions."""
    try:
        with ProgressDisplay(session.config.generations, session.generation) as progress:
            while not session.evolved:
                progress.show(*session.step())
        present(session.folder, session.finish())
    except OSError as error:
        what = f"{error.strerror or error}, {error.filename or session.folder}"
        raise OSError(
            f"cannot write: {what}; make room, then go on with: hebbtorch evolve --resume "
            f"{session.folder}"
        ) from error
    except KeyboardInterrupt:
        terminal.say(f"stopped; go on with: hebbtorch evolve --resume {session.folder}")
        raise
