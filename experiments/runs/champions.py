"""The best individuals of an evolution, in one file that is enough to bring them back to life."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import safetensors
import safetensors.torch
from torch import Tensor

from experiments.config import EvolveConfig
from experiments.files.atomic import write_atomically
from experiments.runs.names import CHAMPIONS

__all__ = ["Champions"]


@dataclass(frozen=True)
class Champions:
    """The best individual of each run.

    Attributes:
        config: the options of the evolution.
        genomes: shape (runs, G).
        fitness: as evaluated in the evolution [m/s], shape (runs,), float64.
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
        tensors = {"genomes": self.genomes.contiguous(), "fitness": self.fitness.double()}
        content = safetensors.torch.save(tensors, metadata={"config": self.config.to_json()})
        write_atomically(folder / CHAMPIONS, content)
        return folder / CHAMPIONS

    @classmethod
    def load(cls, folder: Path) -> Champions:
        """Read the file of a run's folder.

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
            with safetensors.safe_open(path, framework="pt") as file:
                config = EvolveConfig.from_json(file.metadata()["config"])
                return cls(config, file.get_tensor("genomes"), file.get_tensor("fitness"))
        except (safetensors.SafetensorError, KeyError, TypeError, ValueError) as error:
            raise ValueError(f"run: cannot read {str(path)!r}: {error}") from error
