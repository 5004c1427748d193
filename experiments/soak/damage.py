"""Finished runs with one bit changed somewhere: nothing of it may be taken for sound."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch

from experiments.runs.archive import Archive
from experiments.runs.champions import Champions
from experiments.runs.config_file import read_config
from experiments.runs.folder import RunStore, read_checkpoint
from experiments.runs.names import ARCHIVE, CHAMPIONS, CHECKPOINT, CONFIG, HISTORY

__all__ = ["DamageCounts", "Original", "try_flip"]

_FILES = (CONFIG, CHECKPOINT, CHAMPIONS, ARCHIVE, HISTORY)


@dataclass
class DamageCounts:
    """What became of damaged files.

    Attributes:
        flips: Changed bits, by file.
        noticed: Refused in words.
        harmless: Read, with the content that it had before.
        repaired: Histories that were written anew from the checkpoint.
        silent: Read with another content, which should never happen.
        errors: Exceptions of other kinds, which should never happen.
    """

    flips: Counter[str] = field(default_factory=Counter)
    noticed: int = 0
    harmless: int = 0
    repaired: int = 0
    silent: Counter[str] = field(default_factory=Counter)
    errors: Counter[str] = field(default_factory=Counter)


class Original:
    """A finished run as it should be read.

    Args:
        folder: The folder of the run, which is changed and put right again.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.files = {name: (folder / name).read_bytes() for name in _FILES}
        self.content = _content(folder)

    def restore(self) -> None:
        """Put every file right."""
        for name, content in self.files.items():
            (self.folder / name).write_bytes(content)


def try_flip(seed: int, trial: int, original: Original, counts: DamageCounts) -> None:
    """Change one bit of one file, and read the run.

    Args:
        seed: The seed of all trials.
        trial: Number of this one; with the seed it decides which bit.
        original: The run; it is put right afterwards.
        counts: The counts so far, to which this trial is added.
    """
    draws = np.random.default_rng((seed, 2, trial))
    name = str(draws.choice(_FILES))
    content = bytearray(original.files[name])
    content[int(draws.integers(len(content)))] ^= 1 << int(draws.integers(8))
    (original.folder / name).write_bytes(content)
    counts.flips[name] += 1
    try:
        if name == HISTORY:
            RunStore.resume(original.folder)[0].close()
        found = _content(original.folder)
    except ValueError:
        counts.noticed += 1
    except Exception as error:
        counts.errors[f"{name}: {type(error).__name__}"] += 1
    else:
        same = _same(found, original.content)
        if same and name == HISTORY:
            same = (original.folder / name).read_bytes() == original.files[name]
            counts.repaired += same
        elif same:
            counts.harmless += 1
        if not same:
            counts.silent[name] += 1
    finally:
        original.restore()


def _content(folder: Path) -> list[object]:
    """Everything that this project reads of a run."""
    config = read_config(folder)
    checkpoint = read_checkpoint(folder, config)
    champions, archive = Champions.load(folder), Archive.load(folder)
    assert archive is not None
    return [
        config,
        checkpoint.generation,
        checkpoint.strategy,
        checkpoint.history.to_tensor(),
        *(champions.config, champions.genomes, champions.fitness),
        *(archive.config, archive.generations, archive.genomes, archive.fitness),
    ]


def _same(one: object, other: object) -> bool:
    """Whether nested containers hold the same numbers, bit by bit."""
    if isinstance(one, torch.Tensor) and isinstance(other, torch.Tensor):
        return one.dtype == other.dtype and torch.equal(one.nan_to_num(7e7), other.nan_to_num(7e7))
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(_same(one[key], other[key]) for key in one)
    if isinstance(one, list | tuple) and isinstance(other, list | tuple):
        return len(one) == len(other) and all(map(_same, one, other))
    return type(one) is type(other) and one == other
