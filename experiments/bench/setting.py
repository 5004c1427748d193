"""How much is measured."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Setting"]


@dataclass(frozen=True)
class Setting:
    """Sizes of the measurements; the defaults are those of the table.

    Attributes:
        cores: that an evolution may use; all else runs on one.
        seed: The seed of gaits, genomes and terrains.
        worlds: The number of worlds of a batch; a multiple of `workload.GAITS`.
        steps: The engine steps of one repetition, 1 s.
        warm_up: steps before the first repetition: the robots have landed and walk.
        repetitions: How often everything but whole processes is measured in each pass.
        passes: over everything but whole processes, so that a minute in which something else
            slows the machine down does not decide a row.
        most_worlds: The number of worlds of the largest batch.
        runs, population, generations, duration: The size of the evolution that is timed; its first
            generation compiles and does not count.
        cold_starts, warm_starts: How many processes are started with empty and with full caches.
        pairs: The number of pairs of measurements, in turns with another checkout.
    """

    cores: int
    seed: int = 0
    worlds: int = 400
    steps: int = 60
    warm_up: int = 180
    repetitions: int = 5
    passes: int = 3
    most_worlds: int = 4000
    runs: int = 10
    population: int = 40
    generations: int = 8
    duration: float = 60.0
    cold_starts: int = 2
    warm_starts: int = 7
    pairs: int = 15

    @classmethod
    def of(cls, *, quick: bool, cores: int, seed: int) -> Setting:
        """The table's sizes, or those of a quick look: fewer repetitions."""
        if not quick:
            return cls(cores, seed)
        return cls(
            cores,
            seed,
            repetitions=7,
            passes=1,
            generations=3,
            cold_starts=1,
            warm_starts=2,
            pairs=9,
        )
