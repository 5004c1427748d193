"""The best individual of every 25th generation: how what evolves changes in the course of it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import safetensors
import safetensors.torch
import torch
from torch import Tensor

from experiments.config import EvolveConfig
from experiments.files.atomic import write_atomically
from experiments.runs.names import ARCHIVE

__all__ = ["ARCHIVE_INTERVAL", "Archive"]

ARCHIVE_INTERVAL = 25
"""Generations from one that is kept to the next; the first one is kept, too."""


@dataclass(frozen=True)
class Archive:
    """The best individuals of K generations of several runs, in the order of the generations.

    Attributes:
        config: the options of the evolution.
        generations: which ones, from 1; shape (K,), int64.
        genomes: shape (K, runs, G).
        fitness: as evaluated in that generation [m/s], shape (K, runs), float64; NaN where the
            whole population failed.
    """

    config: EvolveConfig
    generations: Tensor
    genomes: Tensor
    fitness: Tensor

    @classmethod
    def empty(cls, config: EvolveConfig, n_genes: int) -> Archive:
        """An archive without any generation yet."""
        return cls(
            config,
            torch.empty(0, dtype=torch.int64),
            torch.empty(0, config.runs, n_genes),
            torch.empty(0, config.runs, dtype=torch.float64),
        )

    @staticmethod
    def keeps(generation: int) -> bool:
        """Whether the best of a generation, from 1, are to be kept."""
        return generation == 1 or generation % ARCHIVE_INTERVAL == 0

    def with_generation(self, generation: int, genomes: Tensor, fitness: Tensor) -> Archive:
        """This archive and the best individuals of one more generation.

        Args:
            generation: later than all in here.
            genomes: of the population of each run, shape (runs, population, G).
            fitness: shape (runs, population) [m/s], NaN where an individual failed.
        """
        best = fitness.nan_to_num(nan=-math.inf).argmax(1)
        runs = torch.arange(len(best))
        return Archive(
            self.config,
            torch.cat([self.generations, torch.tensor([generation])]),
            torch.cat([self.genomes, genomes[runs, best].detach().cpu()[None]]),
            torch.cat([self.fitness, fitness[runs, best].double().cpu()[None]]),
        )

    def until(self, generation: int) -> Archive:
        """The part up to a generation, which is included."""
        kept = self.generations <= generation
        return Archive(self.config, self.generations[kept], self.genomes[kept], self.fitness[kept])

    def save(self, folder: Path) -> Path:
        """Write the file into a run's folder, in place of the one that may be there."""
        tensors = {
            "generations": self.generations.contiguous(),
            "genomes": self.genomes.contiguous(),
            "fitness": self.fitness.contiguous(),
        }
        content = safetensors.torch.save(tensors, metadata={"config": self.config.to_json()})
        write_atomically(folder / ARCHIVE, content)
        return folder / ARCHIVE

    @classmethod
    def load(cls, folder: Path) -> Archive | None:
        """Read the file of a run's folder.

        Returns:
            None if there is none, as in runs begun before archives were kept.

        Raises:
            ValueError: it is damaged.
        """
        path = folder / ARCHIVE
        if not path.is_file():
            return None
        try:
            with safetensors.safe_open(path, framework="pt") as file:
                config = EvolveConfig.from_json(file.metadata()["config"])
                names = ("generations", "genomes", "fitness")
                return cls(config, *(file.get_tensor(name) for name in names))
        except (safetensors.SafetensorError, KeyError, TypeError, ValueError) as error:
            raise ValueError(
                f"run: cannot read {str(path)!r}: {error}; put back a copy of it, or remove it to "
                "go on without the generations in it"
            ) from error
