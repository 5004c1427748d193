"""One condition: an ordinary evolution in its folder, begun or taken up where it stood."""

from __future__ import annotations

from pathlib import Path

from experiments.analysis.presentation import log_champion
from experiments.campaign.grid import Condition
from experiments.config import EvolveConfig
from experiments.evolution.evolve import Session
from experiments.evolution.progress import ProgressDisplay
from experiments.runs.champions import Champions

__all__ = ["open_session", "run_condition"]

_INTERVAL = 60.0  # between plain lines of progress [s]


def open_session(config: EvolveConfig, folder: Path, overview: Path | None = None) -> Session:
    """A condition's evolution, begun or taken up where it stood.

    Args:
        config: The options of the evolution.
        folder: The folder of the run.
        overview: folder of the TensorBoard run with the median over its runs; by default in
            `folder`.

    Raises:
        ValueError: the folder cannot be used; nothing was changed then.
    """
    if folder.exists():
        return Session.resume(folder, overview=overview)
    return Session.create(config, folder, overview=overview)


def run_condition(condition: Condition, folder: Path, overview: Path, label: str) -> Champions:
    """Evolve a condition to its end, from wherever it stands.

    Args:
        condition: The condition, its config with the options of the machine.
        folder: The folder of its run.
        overview: as in `open_session`.
        label: what to call it while it runs, short.

    Raises:
        ValueError: the folder cannot be used; nothing was changed then.
        KeyboardInterrupt: it was stopped; it can be called again.
    """
    with open_session(condition.config, folder, overview) as session:
        generations, done = condition.config.generations, session.generation
        with ProgressDisplay(generations, done, label=label, interval=_INTERVAL) as progress:
            while not session.evolved:
                progress.show(*session.step())
        champions = session.finish()
    log_champion(folder, champions)
    return champions
