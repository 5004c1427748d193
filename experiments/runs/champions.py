"""The best individuals of an evolution, in one file that is enough to evaluate them again."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from torch import Tensor

from experiments.config import EvolveConfig
from experiments.config.checks import on_this_machine
from experiments.io.tensors import read_tensors, write_tensors
from experiments.runs.names import CHAMPIONS

__all__ = ["Champions"]


@dataclass(frozen=True)
class Champions:
    """The best individual of each run.

    Attributes:
        config: the options of the evolution.
        genomes: shape (runs, G).
        fitness: Fitness as evaluated in the evolution [m/s], shape (runs,), float64.
    """

    config: EvolveConfig
    genomes: Tensor
    fitness: Tensor

    @property
    def best_run(self) -> int:
        """The run whose champion is the fittest."""
        return int(self.fitness.nan_to_num(nan=-math.inf).argmax())

    def save(self, folder: Path) -> Path:
        """Write the file into a run's folder, in place of the one that may be there."""
        tensors = {"genomes": self.genomes, "fitness": self.fitness.double()}
        write_tensors(folder / CHAMPIONS, tensors, self.config.to_json())
        return folder / CHAMPIONS

    @classmethod
    def load(cls, folder: Path, *, as_recorded: bool = False) -> Champions:
        """Read the file of a run's folder.

        Args:
            folder: The folder of the run.
            as_recorded: whether to leave the options as they are; else, champions that evolved on
                a device that this machine lacks come with the CPU in its place.

        Raises:
            ValueError: there is none, or it is damaged.
        """
        path = folder / CHAMPIONS
        if not path.is_file():
            raise ValueError(
                f"run: expected the folder of a finished run, got {str(folder)!r} without "
                f"{CHAMPIONS}; "
                f"finish it with `hebbtorch evolve --resume {folder}`"
            )
        try:
            tensors, text = read_tensors(path, ("genomes", "fitness"))
            config = EvolveConfig.from_json(text)
            config.validate(machine=False)
            genomes, fitness = tensors["genomes"], tensors["fitness"]
            if genomes.shape[:-1] != fitness.shape or fitness.shape != (config.runs,):
                raise ValueError(f"expected {config.runs} genomes and as many fitness values")
            return cls(config if as_recorded else on_this_machine(config), genomes, fitness)
        except ValueError as error:
            raise ValueError(f"run: cannot read {str(path)!r}: {error}") from error
