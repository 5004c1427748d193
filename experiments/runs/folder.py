"""The folder of an evolution, RUN: nothing in it is ever half written or overwritten unasked.

- config.json: the options.
- checkpoint.pt: all it takes to go on exactly, replaced after every generation.
- history.csv: fitness, one row per run and generation.
- archive.safetensors: the best genome of each run in every 25th generation.
- champion.safetensors: the best genome of each run, once the evolution is finished.
- events.out.tfevents.*: TensorBoard; in run-0/, run-1/ ... and over-runs/ for several runs.
- lock: held by the process that writes here.
"""

from __future__ import annotations

import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import IO, Any

from experiments.config import EvolveConfig
from experiments.io import torchfile
from experiments.io.atomic import remove_leftovers, write_atomically
from experiments.io.formats import require_format
from experiments.io.locks import LOCK, lock_folder
from experiments.runs.config_file import read_config, write_config
from experiments.runs.history import History
from experiments.runs.names import ARCHIVE, CHAMPIONS, CHECKPOINT, CONFIG, HISTORY

__all__ = [
    "Checkpoint",
    "RunStore",
    "read_checkpoint",
    "read_config",
]

_FORMAT = 2  # of checkpoint.pt


@dataclass
class Checkpoint:
    """All it takes to go on exactly.

    Attributes:
        generation: How many generations are done.
        strategy: state of the evolution strategy, plain tensors and numbers.
        history: the rows of the generations done.
    """

    generation: int
    strategy: dict[str, Any]
    history: History = field(default_factory=History)


class RunStore:
    """A run's folder, locked for this process. Use :meth:`create` or :meth:`resume`."""

    def __init__(self, folder: Path, config: EvolveConfig, lock: IO[str]) -> None:
        self.folder = folder
        self.config = config
        self._lock = lock

    @property
    def history_file(self) -> Path:
        """Where history.csv is."""
        return self.folder / HISTORY

    @classmethod
    def create(cls, folder: Path, config: EvolveConfig, start: Checkpoint) -> RunStore:
        """Create a run's folder, complete from its first instant on.

        Args:
            folder: must not exist yet, or be empty.
            config: the options, already validated.
            start: the state before the first generation.

        Raises:
            ValueError: the folder is not empty, or cannot be written.
        """
        folder = Path(os.path.abspath(folder))  # whatever the working directory becomes
        with _readable_errors(folder):
            _refuse_occupied(folder)
            if folder.is_dir():
                return cls._create_within(folder, config, start)
            # A name of its own, since a long one has no room for more.
            draft = folder.with_name(f".hebbtorch-{secrets.token_hex(4)}")
            draft.mkdir(parents=True)
            with ExitStack() as undo:
                undo.callback(shutil.rmtree, draft, ignore_errors=True)
                lock = undo.enter_context(lock_folder(draft))
                store = cls._fill(draft, config, start, lock)
                os.rename(draft, folder)  # fails if something came between
                undo.pop_all()
            store.folder = folder
            return store

    @classmethod
    def _create_within(cls, folder: Path, config: EvolveConfig, start: Checkpoint) -> RunStore:
        """Make an existing, empty folder a run's: a link, a mount point, the working directory.

        It cannot be replaced by another one. A kill leaves files that the next try takes away.
        """
        with ExitStack() as undo:
            lock = undo.enter_context(lock_folder(folder))
            _refuse_occupied(folder)  # again, now that no other process comes between
            for name in (LOCK, CHECKPOINT, HISTORY, CONFIG):
                undo.callback(folder.joinpath(name).unlink, missing_ok=True)
            store = cls._fill(folder, config, start, lock)
            undo.pop_all()
        return store

    @classmethod
    def _fill(
        cls, folder: Path, config: EvolveConfig, start: Checkpoint, lock: IO[str]
    ) -> RunStore:
        """Write the first files; the one that makes the folder a run's is the last."""
        store = cls(folder, config, lock)
        write_atomically(folder / CHECKPOINT, store._content(start))
        start.history.write(store.history_file)
        write_config(folder, config)
        return store

    @classmethod
    def resume(cls, folder: Path, generations: int | None = None) -> tuple[RunStore, Checkpoint]:
        """Open a run's folder to go on, and read where it stood.

        Files that run ahead of the checkpoint are cut back to it, once it is found good.

        Args:
            folder: The folder of the run.
            generations: how many the run shall have from now on; None: as many as before.

        Raises:
            ValueError: it is not a run's folder, another process works there, its checkpoint is
                damaged, its options were changed, or it has done more generations.
        """
        folder = Path(os.path.abspath(folder))
        config = read_config(folder)
        with _readable_errors(folder, "see that it can be written, and try again"):
            with ExitStack() as undo:
                store = cls(folder, config, undo.enter_context(lock_folder(folder)))
                checkpoint = read_checkpoint(folder, config)
                if generations is not None:
                    store._extend(generations, checkpoint.generation)
                remove_leftovers(folder, (CHECKPOINT, CONFIG, HISTORY, ARCHIVE, CHAMPIONS))
                checkpoint.history.write(store.history_file)
                undo.pop_all()
            return store, checkpoint

    def _extend(self, generations: int, done: int) -> None:
        """Give the run another length."""
        config = replace(self.config, generations=generations)
        config.validate()
        if generations < done:
            raise ValueError(
                f"generations: expected at least the {done} that are done, got {generations}"
            )
        if config != self.config:
            write_config(self.folder, config)
            self.config = config

    def save(self, checkpoint: Checkpoint) -> None:
        """Replace the checkpoint; whatever happens meanwhile, the old or the new one is there.

        Raises:
            OSError: it cannot be written.
        """
        content = self._content(checkpoint)
        self.require_own()
        write_atomically(self.folder / CHECKPOINT, content)

    def _content(self, checkpoint: Checkpoint) -> bytes:
        """Of the file."""
        return torchfile.saved(
            {
                "format": _FORMAT,
                "config": self.config.to_json(),
                "generation": checkpoint.generation,
                "strategy": checkpoint.strategy,
                "history": checkpoint.history.to_tensor(),
            }
        )

    def require_own(self) -> None:
        """See that the folder is still the one that this process has locked.

        Raises:
            ValueError: it was moved or deleted; another run may be in its place.
        """
        lock = self.folder / LOCK
        held = os.fstat(self._lock.fileno())
        if not (lock.exists() and os.path.samestat(held, lock.stat())):
            raise ValueError(
                f"run: expected {str(self.folder)!r} as this run made it, got another folder or "
                "none; it was moved or deleted meanwhile, and nothing more is written there"
            )

    def close(self) -> None:
        """Let other processes work here."""
        self._lock.close()

    def __enter__(self) -> RunStore:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()


def read_checkpoint(folder: Path, config: EvolveConfig) -> Checkpoint:
    """Where a run stands, without touching it.

    Args:
        folder: The folder of the run.
        config: The run's options.

    Raises:
        ValueError: the checkpoint is damaged, or of another run.
    """
    path = folder / CHECKPOINT
    try:
        content, sealed = torchfile.load(path)
        if content["format"] != 1 or sealed:  # files in format 1 had no digest
            require_format(content["format"], _FORMAT)
            if not sealed:
                raise ValueError("without its digest")
        saved_config = EvolveConfig.from_json(content["config"])
        checkpoint = Checkpoint(
            generation=content["generation"],
            strategy=content["strategy"],
            history=History.from_tensor(content["history"]),
        )
    except Exception as error:  # whatever a damaged file makes the readers raise
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise ValueError(
            f"resume: cannot read {str(path)!r} ({reason}); nothing was changed: put back a copy "
            "of it, or start again with another --out"
        ) from error
    if replace(saved_config, generations=config.generations) != config:
        raise ValueError(
            f"resume: {CONFIG} in {str(path.parent)!r} is not the one this run started with; "
            "undo the change, or start again with another --out"
        )
    return checkpoint


def _refuse_occupied(folder: Path) -> None:
    if folder.is_dir():
        if not _is_unborn(folder):
            raise ValueError(
                f"out: expected a new or empty folder, got {str(folder)!r}, which is not empty; "
                f"go on with it by --resume {folder}, or choose another --out"
            )
    elif folder.exists():
        raise ValueError(f"out: expected a folder, got the file {str(folder)!r}; choose another")


def _is_unborn(folder: Path) -> bool:
    """Whether it is empty, or a kill left it before it was a run's, without any generation."""
    first = {LOCK, CHECKPOINT, HISTORY}
    found = {path.name.removesuffix(".tmp") for path in folder.iterdir()}
    history = folder / HISTORY
    is_empty = not history.exists() or history.read_text(encoding="utf-8").count("\n") <= 1
    return found <= {*first, CONFIG} and not (folder / CONFIG).exists() and is_empty


@contextmanager
def _readable_errors(folder: Path, cure: str = "choose another --out") -> Iterator[None]:
    """Turn what the operating system objects to into one clear line."""
    try:
        yield
    except OSError as error:
        raise ValueError(f"out: cannot write {str(folder)!r} ({error.strerror}); {cure}") from error
