"""Evolutions that are killed again and again while they write, and must end as if never killed.

A victim counts what it does to files below its folder - opening one to write, giving a name, taking
one away - and kills itself with SIGKILL before one of these, or in the middle of a file that has
reached some length. Which one is drawn from the seed, so that every kind of write is met, and no
clock decides anything.
"""

from __future__ import annotations

import os
import resource
import shutil
import signal
import sys
from collections import Counter
from dataclasses import dataclass, field
from multiprocessing import get_context
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import numpy as np

from experiments.config import EvolveConfig
from experiments.evolution.evolve import Session
from experiments.io.locks import LOCK
from experiments.runs.names import ARCHIVE, CHAMPIONS, CONFIG, HISTORY

__all__ = ["CONFIG_OF_VICTIMS", "KillCounts", "try_kills", "undisturbed"]

CONFIG_OF_VICTIMS = EvolveConfig(
    shape="worm-2x1", population=4, generations=4, duration=0.1, runs=2, threads=1, seed=11
)
_PATIENCE = 600.0  # with a victim, far more than it takes [s]
_MOST_KILLS = 6  # of a chain; then it may finish
_LIKELY_EVENTS = 120  # of files in the life of a victim
_LIKELY_BYTES = 60_000  # of its longest file
_REFUSED = 3  # exit code of a victim that could not start


@dataclass
class KillCounts:
    """What became of killed evolutions.

    Attributes:
        chains: Evolutions that were killed until they ended.
        kills: How often, by what was about to be done, or was being written.
        refused: Starts that refused the folder, by their message; none should.
        different: Chains that did not end as one that was never killed.
        leftovers: Files that were left in finished folders.
        hung: Victims that did not end.
    """

    chains: int = 0
    kills: Counter[str] = field(default_factory=Counter)
    refused: Counter[str] = field(default_factory=Counter)
    different: int = 0
    leftovers: int = 0
    hung: int = 0


def undisturbed(folder: Path) -> dict[str, bytes]:
    """The outcome of an evolution of victims that nobody kills.

    Args:
        folder: New, for the run.
    """
    _start(folder, 0, 0, folder.parent / "witness").join()
    return outcome(folder)


def outcome(folder: Path) -> dict[str, bytes]:
    """What an evolution ended with, without the time that it took."""
    history = (folder / HISTORY).read_text(encoding="utf-8").splitlines()
    content = {name: (folder / name).read_bytes() for name in (CONFIG, CHAMPIONS, ARCHIVE)}
    content[HISTORY] = "\n".join(line.rpartition(",")[0] for line in history).encode()
    return content


def try_kills(
    seed: int, chain: int, place: Path, expected: dict[str, bytes], counts: KillCounts
) -> None:
    """One chain of kills.

    Args:
        seed: The seed of all chains.
        chain: Number of this one; with the seed it decides where its victims are killed.
        place: Folder for the run, which is removed again unless something is wrong with it.
        expected: The undisturbed outcome.
        counts: The counts so far, to which this trial is added.
    """
    draws = np.random.default_rng((seed, 1, chain))
    folder, witness = place / f"chain-{chain}", place / "witness"
    for kill in range(_MOST_KILLS + 1):
        event = int(draws.integers(1, _LIKELY_EVENTS)) if draws.random() < 0.7 else 0
        size = int(draws.integers(1, _LIKELY_BYTES)) if not event else 0
        if kill == _MOST_KILLS:
            event = size = 0
        witness.unlink(missing_ok=True)
        process = _start(folder, event, size, witness)
        process.join(_PATIENCE)
        if process.is_alive():
            process.kill()
            process.join()
            counts.hung += 1
            return
        told = witness.read_text(encoding="utf-8") if witness.exists() else ""
        if process.exitcode in (-signal.SIGKILL, -signal.SIGXFSZ):
            counts.kills[told or "middle of a file"] += 1
        elif process.exitcode:
            counts.refused[told or f"exit code {process.exitcode}"] += 1
            return
        else:
            break
    counts.chains += 1
    left = [path.name for path in folder.iterdir() if _is_leftover(path.name)]
    counts.leftovers += len(left)
    if outcome(folder) != expected:
        counts.different += 1
    elif not left:
        shutil.rmtree(folder)
    for draft in place.glob(".hebbtorch-*"):  # folders that were never finished
        shutil.rmtree(draft)


def _is_leftover(name: str) -> bool:
    return name.endswith(".tmp") or (name.startswith(".") and name != LOCK)


def _start(folder: Path, event: int, size: int, witness: Path) -> BaseProcess:
    """A victim: a fork, which spares it the time that imports take."""
    arguments = (folder, event, size, witness)
    process = get_context("fork").Process(target=_be_victim, args=arguments)
    process.start()
    return process


def _be_victim(folder: Path, event: int, size: int, witness: Path) -> None:
    """Begin or go on with a run, and die when it is time.

    Args:
        folder: The folder of the run.
        event: Number of the event before which it dies; 0: none.
        size: Bytes that no file may have more than; 0: any number.
        witness: File to tell what it was about to do, or what it complained of.
    """
    with Path(os.devnull).open("w") as nowhere:
        os.dup2(nowhere.fileno(), 1)
    if event:
        sys.addaudithook(_Death(folder, event, witness))
    if size:
        signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
    try:
        with Session.open(CONFIG_OF_VICTIMS, folder) as session:
            while not session.evolved:
                session.step()
            session.finish()
    except Exception as error:
        words = str(error) or type(error).__name__
        witness.write_text(words.replace(str(folder), "RUN").splitlines()[0], encoding="utf-8")
        os._exit(_REFUSED)


class _Death:
    """An audit hook that kills this process before a file event of some number."""

    def __init__(self, folder: Path, event: int, witness: Path) -> None:
        self._place = str(folder.parent)
        self._left = event
        self._witness = witness

    def __call__(self, name: str, arguments: tuple[Any, ...]) -> None:
        if name == "open":
            path, _, flags = arguments
            if not isinstance(flags, int) or not flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT):
                return
        elif name in ("os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.truncate"):
            path = arguments[0]
        else:
            return
        if not isinstance(path, str | bytes | Path):
            return
        path = os.fsdecode(path)
        if not path.startswith(self._place):
            return
        self._left -= 1
        if self._left == 0:
            self._left = -1  # what follows is told to nobody
            file = Path(path).name
            kind = "event file" if file.startswith("events.") else file
            kind = "draft" if kind.startswith(".hebbtorch-") else kind
            self._witness.write_text(f"{name.removeprefix('os.')} {kind}", encoding="utf-8")
            os.kill(os.getpid(), signal.SIGKILL)
