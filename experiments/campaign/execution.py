"""One condition: an ordinary evolution in its folder, begun or taken up where it stood."""

from __future__ import annotations

from pathlib import Path

from experiments.analysis.presentation import log_champion
from experiments.campaign.grid import Condition
from experiments.evolution.evolve import Session
from experiments.evolution.progress import ProgressDisplay
from experiments.runs.champions import Champions

__all__ = ["run_condition"]

_INTERVAL = 60.0  # between plain lines of progress [s]


def run_condition(condition: Condition, folder: Path, overview: Path, label: str) -> Champions:
    """Evolve a condition to its end, from wherever it stands.

    Args:
        condition: The condition, its config with the options of the machine.
        folder: The folder of its run.
        overview: as in `Session.open`.
        label: what to call it while it runs, short.

    Raises:
        ValueError: the folder cannot be used; nothing was changed then.
        KeyboardInterrupt: it was stopped; it can be called again.
    """
    with Session.open(condition.config, folder, overview=overview) as session:
        generations, done = condition.config.generations, session.generation
        with ProgressDisplay(generations, done, label=label, interval=_INTERVAL) as progress:
            while not session.evolved:
                progress.show(*session.step())
        champions = session.finish()
    log_champion(folder, champions)
    return champions
