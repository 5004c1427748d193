"""The best individual of every 25th generation: how what evolves changes in the course of it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from experiments.config import EvolveConfig
from experiments.io.tensors import read_tensors, write_tensors
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
        fitness: Fitness as evaluated in that generation [m/s], shape (K, runs), float64; NaN where
            the whole population failed.
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
            torch.empty(0, dtype=torch.int64, device="cpu"),
            torch.empty(0, config.runs, n_genes, dtype=torch.float32, device="cpu"),
            torch.empty(0, config.runs, dtype=torch.float64, device="cpu"),
        )

    @staticmethod
    def keeps(generation: int) -> bool:
        """Whether the best of a generation, from 1, are to be kept."""
        return generation == 1 or generation % ARCHIVE_INTERVAL == 0

    def with_generation(self, generation: int, genomes: Tensor, fitness: Tensor) -> Archive:
        """This archive and the best individuals of one more generation.

        Args:
            generation: later than all in here.
            genomes: The genomes of the population of each run, shape (runs, population, G).
            fitness: shape (runs, population) [m/s], NaN where an individual failed.
        """
        best = fitness.nan_to_num(nan=-math.inf).argmax(1)
        runs = torch.arange(len(best), device="cpu")
        return Archive(
            self.config,
            torch.cat([self.generations, torch.tensor([generation], device="cpu")]),
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
            "generations": self.generations,
            "genomes": self.genomes,
            "fitness": self.fitness,
        }
        write_tensors(folder / ARCHIVE, tensors, self.config.to_json())
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
            names = ("generations", "genomes", "fitness")
            tensors, text = read_tensors(path, names)
            config = EvolveConfig.from_json(text)
            config.validate(machine=False)
            return cls(config, *(tensors[name] for name in names))
        except ValueError as error:
            raise ValueError(
                f"run: cannot read {str(path)!r}: {error}; put back a copy of it, or remove it to "
                "go on without the generations in it"
            ) from error
