"""One condition: an ordinary evolution in its folder, begun or taken up where it stood."""

from __future__ import annotations

from pathlib import Path

from experiments.campaign.grid import Condition
from experiments.config import EvolveConfig
from experiments.evolution.evolve import Session
from experiments.evolution.progress import ProgressDisplay
from experiments.runs.champions import Champions

__all__ = ["open_session", "run_condition"]

_INTERVAL = 60.0  # between plain lines of progress [s]


def open_session(config: EvolveConfig, folder: Path) -> Session:
    """A condition's evolution, begun or taken up where it stood.

    Raises:
        ValueError: the folder cannot be used; nothing was changed then.
    """
    return Session.resume(folder) if folder.exists() else Session.create(config, folder)


def run_condition(condition: Condition, folder: Path, label: str) -> Champions:
    """Evolve a condition to its end, from wherever it stands.

    Args:
        condition: with the options of the machine.
        folder: of its run.
        label: what to call it while it runs.

    Raises:
        ValueError: the folder cannot be used; nothing was changed then.
        KeyboardInterrupt: it was stopped; it can be called again.
    """
    with open_session(condition.config, folder) as session:
        generations, done = condition.config.generations, session.generation
        with ProgressDisplay(generations, done, label=label, interval=_INTERVAL) as progress:
            while not session.evolved:
                progress.show(*session.step())
        return session.finish()
