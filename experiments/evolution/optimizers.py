"""The strategies that `--optimizer` names: Algorithm 1, and pycma behind the same calls."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from torch import Tensor

import hebbtorch
from experiments.config import EvolveConfig

__all__ = ["CovarianceAdaptation", "optimizer_of"]


_MOST_GENES = 1500  # of a full covariance matrix: its decomposition takes the cube of it


def optimizer_of(config: EvolveConfig, n_genes: int) -> hebbtorch.AskTell:
    """The strategy that a configuration names.

    Args:
        config: The options of the evolution.
        n_genes: Genes of an individual.

    Raises:
        ValueError: pycma is not installed, or cannot handle so many genes.
    """
    if config.optimizer == "es":
        return hebbtorch.EvolutionStrategy(
            n_genes,
            population=config.population,
            sigma=config.sigma,
            runs=config.runs,
            seed=config.seed,
        )
    return CovarianceAdaptation(config, n_genes)


class CovarianceAdaptation:
    """CMA-ES for several runs; each draws from a generator of its own, seeded with the run's seed.

    What it has been told is its whole state: going on replays the recorded fitness, so that
    nothing but numbers is kept on disk, and the genomes asked for are the same again.

    Source: Hansen, "The CMA evolution strategy: a tutorial", arXiv 1604.00772; "sep-cma" adapts
    the diagonal alone (Ros and Hansen 2008).

    Args:
        config: The options: optimizer, population, sigma (of the first population, around zero),
            runs and seed.
        n_genes: Genes of an individual.

    Raises:
        ValueError: pycma is not installed, or cannot handle so many genes.
    """

    def __init__(self, config: EvolveConfig, n_genes: int) -> None:
        if config.optimizer == "cma" and n_genes > _MOST_GENES:
            raise ValueError(
                f"optimizer: expected sep-cma or es for {n_genes} genes, got cma, which takes up "
                f"to {_MOST_GENES}"
            )
        self._config = config
        self._n_genes = n_genes
        self._told: list[Tensor] = []  # (runs, population) per generation
        self._strategies = [self._new(config.seed + run) for run in range(config.runs)]
        self._asked: list[list[np.ndarray]] | None = None
        self._best = torch.zeros(config.runs, n_genes)
        self._best_fitness = torch.full((config.runs,), torch.nan, dtype=torch.float64)

    def _new(self, seed: int) -> Any:
        try:
            import cma
        except ImportError:
            raise ValueError(
                "optimizer: expected pycma for cma and sep-cma, got none; "
                "install it with pip install 'hebbtorch[optimizers]'"
            ) from None
        draws = np.random.RandomState(seed % 2**32)
        options = {
            "popsize": self._config.population,
            "randn": lambda *shape: draws.randn(*shape),
            "seed": np.nan,  # the global generator stays as it is
            "verbose": -9,
            "CMA_diagonal": self._config.optimizer == "sep-cma",
        }
        return cma.CMAEvolutionStrategy(np.zeros(self._n_genes), self._config.sigma, options)

    def ask(self) -> Tensor:
        """As in `hebbtorch.EvolutionStrategy`; asked again, it gives the same genomes."""
        if self._asked is None:
            self._asked = [strategy.ask() for strategy in self._strategies]
        genomes = torch.tensor(np.array(self._asked), dtype=torch.float32)
        return genomes if self._config.runs > 1 else genomes[0]

    def tell(self, fitness: Tensor) -> None:
        """As in `hebbtorch.EvolutionStrategy`."""
        told = fitness.detach().to("cpu", torch.float64)
        told = told.reshape(self._config.runs, self._config.population)
        genomes = self.ask().reshape(*told.shape, -1)
        assert self._asked is not None
        for run, strategy in enumerate(self._strategies):
            order = hebbtorch.ranking(told[run])
            self._best[run] = genomes[run, order[0]]
            self._best_fitness[run] = told[run, order[0]]
            ranks = np.empty(len(order))
            ranks[order] = np.arange(len(order))
            strategy.tell(self._asked[run], ranks.tolist())  # it minimizes, and looks at ranks
        self._told.append(told)
        self._asked = None

    @property
    def best(self) -> Tensor:
        """The fittest genome of the last told population."""
        return (self._best if self._config.runs > 1 else self._best[0]).clone()

    @property
    def best_fitness(self) -> Tensor:
        """Its fitness."""
        return (self._best_fitness if self._config.runs > 1 else self._best_fitness[0]).clone()

    def state_dict(self) -> dict[str, Any]:
        """The fitness that it was told, (generations, runs, population), and its options."""
        shape = (0, self._config.runs, self._config.population)
        told = torch.stack(self._told) if self._told else torch.zeros(shape, dtype=torch.float64)
        return {"optimizer": self._config.optimizer, "n_genes": self._n_genes, "fitness": told}

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Go on from a `state_dict()`.

        Raises:
            ValueError: it is of another strategy.
        """
        ours = {"optimizer": self._config.optimizer, "n_genes": self._n_genes}
        for name, value in ours.items():
            if state.get(name) != value:
                raise ValueError(f"state: expected {name} {value!r}, got {state.get(name)!r}")
        fitness = state["fitness"]
        if fitness.shape[1:] != (self._config.runs, self._config.population):
            raise ValueError(f"state: expected fitness of all runs, got {tuple(fitness.shape)}")
        self.__init__(self._config, self._n_genes)  # type: ignore[misc]
        for told in fitness:
            self.tell(told)
