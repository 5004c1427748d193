"""The paper's evolution strategy, by ask and tell (Algorithm 1)."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping, Sequence
from numbers import Integral
from typing import Any

import torch
from torch import Tensor

from hebbtorch.ask_tell import next_population, ranking
from hebbtorch.sampling import draw_uniform


class EvolutionStrategy:
    """Algorithm 1: children are Gaussian mutations of the mean of the fittest; one elite stays.

    It lives on the CPU; fitness may come from any device. Randomness is a function of the run's
    seed and the generation alone, so a strategy resumed from `state_dict()` goes on bit for
    bit, and run r of seed s is, bit for bit, the only run of seed s + r.

    >>> es = EvolutionStrategy(3, population=8, sigma=lambda generation: 0.5 * 0.9**generation)
    >>> for _ in range(60):
    ...     es.tell(-es.ask().square().sum(-1))
    >>> bool(es.best_ever_fitness > -0.001)
    True

    Args:
        n_genes: G, length of a genome.
        population: individuals per run, at least 2.
        sigma: standard deviation of the mutations, in units of the genes; or a schedule, called
            with the number of populations told so far.
        parents: fraction of the population that are parents (rounded down, at least 1).
        runs: independent runs, advanced together.
        seed: The seed of the first run; run r has seed + r.
        dtype: The data type of the genomes.
        initial: What to start from instead of from draws: a genome (G,), which becomes individual 0
            and, mutated, the others; or a whole population, (population, G). With runs > 1 these
            may have a first dimension of runs.

    Attributes:
        generation: number of populations told so far.
        sigma: standard deviation of the next mutations.

    Raises:
        ValueError: an argument that is not as said here.
    """

    def __init__(
        self,
        n_genes: int,
        population: int = 40,
        sigma: float | Callable[[int], float] = 0.35,
        parents: float = 0.25,
        runs: int = 1,
        seed: int = 0,
        dtype: torch.dtype = torch.float32,
        initial: Tensor | None = None,
    ) -> None:
        n_genes = _integer("n_genes", n_genes, 1)
        population = _integer("population", population, 2)
        runs = _integer("runs", runs, 1)
        seed = _integer("seed", seed, None)
        if not dtype.is_floating_point:
            raise ValueError(f"dtype: expected a floating dtype, got {dtype}")
        # A fraction such as 0.29 of 100 is 28.999999999999996 in floating point.
        n_parents = math.floor(parents * population + 1e-9) if math.isfinite(parents) else 0
        if not 1 <= n_parents <= population:
            raise ValueError(
                f"parents: expected a fraction that makes 1 to {population} of the population "
                f"of {population} parents, got {parents!r}"
            )
        self.n_genes = n_genes
        self.population = population
        self._schedule = sigma
        self.n_parents = n_parents
        self.runs = runs
        self.seed = seed
        self.dtype = dtype
        self.generation = 0
        self._asked = False
        self.sigma = self._sigma_now()
        self._first_sigma = self.sigma
        self._genomes = self._first_population(initial)
        self._best = self._genomes[:, 0].clone()
        self._best_fitness = torch.full((runs,), math.nan, dtype=torch.float64, device="cpu")
        self._best_ever = self._best.clone()
        self._best_ever_fitness = self._best_fitness.clone()

    def _first_population(self, initial: Tensor | None) -> Tensor:
        """(runs, population, G): draws, or made from what is known."""
        shape = (self.population, self.n_genes)
        if initial is None:
            draws = [
                draw_uniform(
                    shape, self._generator(run), dtype=self.dtype, device=torch.device("cpu")
                )
                for run in range(self.runs)
            ]
            return torch.stack(draws)  # Algorithm 1, line 2
        given = initial.detach().to("cpu", self.dtype)
        if given.shape[-1:] != (self.n_genes,) or not given.isfinite().all():
            raise ValueError(
                f"initial: expected finite genomes of {self.n_genes} genes, "
                f"got shape {tuple(given.shape)}"
            )
        whole = given.shape in (shape, (self.runs, *shape))
        if whole:
            return given.expand(self.runs, *shape).clone()
        if given.shape not in ((self.n_genes,), (self.runs, self.n_genes)):
            raise ValueError(
                f"initial: expected shape ({self.n_genes},), {shape} or either of them for each "
                f"of {self.runs} runs, got {tuple(given.shape)}"
            )
        starts = given.expand(self.runs, self.n_genes)
        order = list(range(self.population))
        return torch.stack(
            [
                next_population(
                    starts[run].expand(shape), order, 1, self.sigma, self._generator(run)
                )
                for run in range(self.runs)
            ]
        )

    def ask(self) -> Tensor:
        """The genomes to evaluate: (population, G), or (runs, population, G) with runs > 1.

        After the first generation, individual 0 is the best of the one before.

        Raises:
            ValueError: the fitness of the genomes asked for before has not been told.
        """
        if self._asked:
            raise ValueError("ask: expected tell(fitness) of the last genomes first, got ask again")
        self._asked = True
        return self._per_run(self._genomes).clone()

    def tell(self, fitness: Tensor | Sequence[float]) -> None:
        """Take the fitness of the genomes last asked for and make the next population.

        Args:
            fitness: (population,), or (runs, population) with runs > 1; higher is better. NaN
                counts as worst; where a whole run is NaN its individual 0, the elite, stays
                the best, with a fitness of NaN.

        Raises:
            ValueError: wrong shape, or no genomes have been asked for.
        """
        if not self._asked:
            raise ValueError("tell: expected ask() first, got a fitness for no genomes")
        if isinstance(fitness, Tensor):
            given = fitness.detach()
        else:
            given = torch.as_tensor(fitness, device="cpu")
        expected = tuple(self._per_run(self._genomes).shape[:-1])
        if tuple(given.shape) != expected:
            raise ValueError(f"fitness: expected shape {expected}, got {tuple(given.shape)}")
        if given.is_complex():
            raise ValueError(f"fitness: expected real numbers, got {given.dtype}")
        told = given.to("cpu", torch.float64)
        self._asked = False
        self.generation += 1
        self.sigma = self._sigma_now()
        told = told.reshape(self.runs, self.population)
        for run in range(self.runs):
            order = ranking(told[run])
            self._best[run] = self._genomes[run, order[0]]  # Algorithm 1, line 12
            self._best_fitness[run] = told[run, order[0]]
            if not self._best_fitness[run] <= self._best_ever_fitness[run]:
                self._keep_best(run)
            self._genomes[run] = next_population(
                self._genomes[run], order, self.n_parents, self.sigma, self._generator(run)
            )

    @property
    def best(self) -> Tensor:
        """The fittest genome of the last told population: (G,), or (runs, G) with runs > 1.

        Raises:
            ValueError: no fitness has been told.
        """
        return self._told(self._best)

    @property
    def best_fitness(self) -> Tensor:
        """The fitness of `best`, float64: (), or (runs,) with runs > 1.

        Raises:
            ValueError: no fitness has been told.
        """
        return self._told(self._best_fitness)

    @property
    def best_ever(self) -> Tensor:
        """The genome of the highest fitness told so far: (G,), or (runs, G) with runs > 1.

        Where fitness is noisy, as on terrains that change, it is the luckiest, too.

        Raises:
            ValueError: no fitness has been told.
        """
        return self._told(self._best_ever)

    @property
    def best_ever_fitness(self) -> Tensor:
        """The fitness of `best_ever`, float64: (), or (runs,) with runs > 1.

        Raises:
            ValueError: no fitness has been told.
        """
        return self._told(self._best_ever_fitness)

    def state_dict(self) -> dict[str, Any]:
        """All that is needed to go on, as tensors and plain numbers.

        Taken between `ask` and `tell`, it leads to the same genomes being asked for again.
        """
        return {
            **self._configuration(),
            "generation": self.generation,
            "genomes": self._genomes.clone(),
            "best": self._best.clone(),
            "best_fitness": self._best_fitness.clone(),
            "best_ever": self._best_ever.clone(),
            "best_ever_fitness": self._best_ever_fitness.clone(),
        }

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Go on from a `state_dict()`; the next call is `ask()`.

        Raises:
            ValueError: it is of a strategy with other arguments.
        """
        for name, ours in self._configuration().items():
            if state.get(name) != ours:
                raise ValueError(
                    f"state: expected {name} = {ours!r}, that of this strategy, "
                    f"got {state.get(name)!r}"
                )
        tensors = {"genomes": self._genomes, "best": self._best}
        for name, own in tensors.items():
            given = state[name]
            if (given.dtype, given.shape) != (own.dtype, own.shape):
                raise ValueError(
                    f"state: expected {name} of {own.dtype} and shape {tuple(own.shape)}, "
                    f"got {given.dtype} and {tuple(given.shape)}"
                )
        self.generation = state["generation"]
        self._genomes = state["genomes"].clone()
        self._best = state["best"].clone()
        self._best_fitness = state["best_fitness"].clone()
        # States of before these were kept have only the last ones.
        self._best_ever = state.get("best_ever", self._best).clone()
        self._best_ever_fitness = state.get("best_ever_fitness", self._best_fitness).clone()
        self.sigma = self._sigma_now()
        self._asked = False

    def _configuration(self) -> dict[str, int | float]:
        names = ("n_genes", "population", "n_parents", "runs", "seed")
        return {"sigma": self._first_sigma, **{name: getattr(self, name) for name in names}}

    def _sigma_now(self) -> float:
        """Standard deviation of the mutations in the present generation."""
        sigma = self._schedule(self.generation) if callable(self._schedule) else self._schedule
        if not (math.isfinite(sigma) and sigma > 0):
            raise ValueError(f"sigma: expected a positive number, got {sigma!r}")
        return float(sigma)

    def _keep_best(self, run: int) -> None:
        """Remember the last population's best as the best ever, NaN only for want of others."""
        if self._best_fitness[run].isnan() and not self._best_ever_fitness[run].isnan():
            return
        self._best_ever[run] = self._best[run]
        self._best_ever_fitness[run] = self._best_fitness[run]

    def _told(self, value: Tensor) -> Tensor:
        if self.generation == 0:
            raise ValueError("best: expected a tell(fitness) first, got none yet")
        return self._per_run(value).clone()

    def _per_run(self, value: Tensor) -> Tensor:
        return value if self.runs > 1 else value[0]

    def _generator(self, run: int) -> torch.Generator:
        """Source of the random numbers of one run in the present generation."""
        key = f"hebbtorch.EvolutionStrategy {self.seed + run} {self.generation}"
        digest = hashlib.blake2b(key.encode(), digest_size=4).digest()  # torch uses 32 bits
        return torch.Generator("cpu").manual_seed(int.from_bytes(digest, "little"))


def _integer(name: str, value: Any, least: int | None) -> int:
    """An argument that must be an integer, perhaps of at least so much; numpy's count as well."""
    is_integer = isinstance(value, Integral) and not isinstance(value, bool)
    if not is_integer or (least is not None and int(value) < least):
        range_ = "" if least is None else f" of at least {least}"
        raise ValueError(f"{name}: expected an integer{range_}, got {value!r}")
    return int(value)
