"""Folders of finished runs with two random champions, who need no evolution to be looked at."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import torch

from experiments.config import EvolveConfig
from experiments.rollout import controller
from experiments.runs.champions import Champions

PLASTIC = EvolveConfig(
    shape="worm-3x1", sensors="high", duration=1.0, eta=0.2, runs=2, population=8, threads=1
)
STATIC = replace(PLASTIC, controller="mlp", eta=0.01)
RUNS = 2


def random_champions(config: EvolveConfig = PLASTIC, seed: int = 0) -> Champions:
    n_genes = controller.build(config, 1).n_genes
    genomes = torch.randn(RUNS, n_genes, generator=torch.Generator().manual_seed(seed))
    return Champions(config, genomes, torch.tensor([2.0, 3.0], dtype=torch.float64))


def run_folder(parent: Path, config: EvolveConfig = PLASTIC, name: str = "run") -> Path:
    folder = parent / name
    folder.mkdir()
    random_champions(config).save(folder)
    return folder
