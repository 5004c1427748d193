"""The validation matrix: champions on every kind of ground, whole and damaged, several times."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import reduce
from operator import add
from pathlib import Path
from typing import Literal

import torch
from torch import Tensor

from experiments.analysis.unseen import speeds_on
from experiments.io.csvfile import labelled, write_csv
from experiments.rollout import seeds
from experiments.rollout.scenarios import Scenarios
from experiments.runs.champions import Champions

__all__ = ["DAMAGES", "TERRAINS", "Matrix", "validate"]

TERRAINS = ("flat", "hilly-3-30", "hilly-1-10", "steppy-1-10", "uphill-10", "downhill-10")
DAMAGES: tuple[Literal["none", "half"], ...] = ("none", "half")
_SEEDS = 5


@dataclass(frozen=True)
class Matrix:
    """Speeds of champions under many conditions.

    Attributes:
        terrain_seeds: S of them; they decide noise and damage, and the ground where the kind of
            terrain leaves it open.
        speeds: [m/s], shape (runs, terrains, damages, S), float64, by `TERRAINS` and `DAMAGES`;
            NaN where the episode failed.
    """

    terrain_seeds: list[int]
    speeds: Tensor

    def write(self, out: Path) -> Path:
        """Write a CSV file: run, terrain, damage, seed, speed [m/s]."""
        runs = range(len(self.speeds))
        rows = labelled(self.speeds, runs, TERRAINS, DAMAGES, self.terrain_seeds)
        return write_csv(out, ("run", "terrain", "damage", "seed", "speed"), rows)


def validate(champions: Champions, seed: int = 0) -> Matrix:
    """Let champions live, as plastic as they are, under every condition.

    Args:
        champions: The champions of any controller.
        seed: decides noise, damage and the initial weights.
    """
    terrain_seeds = seeds.unseen_terrain_seeds(_SEEDS)
    scenarios = reduce(add, (Scenarios.unseen(kind, terrain_seeds, seed) for kind in TERRAINS))
    speeds = [
        speeds_on(replace(champions.config, damage=damage), champions.genomes, scenarios)
        for damage in DAMAGES
    ]
    by_terrain = [each.unflatten(1, (len(TERRAINS), _SEEDS)) for each in speeds]
    return Matrix(terrain_seeds, torch.stack(by_terrain, 2))
