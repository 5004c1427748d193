"""One controller for bodies of any size: a rule shared by all synapses, evolved on a small worm.

With ``sharing="single"`` a genome holds one rule (A, B, C, D) whatever the size of the network, so
that it can drive another body. Takes a minute on one core.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace

import hebbtorch
from experiments.config import EvolveConfig
from experiments.rollout import fitness
from physics import Morphology


def main(arguments: Sequence[str] | None = None) -> dict[str, float]:
    """Evolves on worm-4x1, and returns the median speed on each body [m/s]."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--generations", type=int, default=30)
    parser.add_argument("--population", type=int, default=32)
    parser.add_argument("--duration", type=float, default=15.0, help="of an episode [s]")
    options = parser.parse_args(arguments)
    config = EvolveConfig(
        shape="worm-4x1", sensors="high", sharing="single", init="uniform",
        duration=options.duration,
    )  # fmt: skip
    evaluate = fitness(config)
    strategy = hebbtorch.EvolutionStrategy(evaluate.n_genes, options.population, seed=1)
    for generation in range(1, options.generations + 1):
        speeds = evaluate(strategy.ask(), generation)
        strategy.tell(speeds)
        print(f"generation {generation}: best {speeds.nan_to_num(-10).max():.2f} m/s")
    champion = strategy.best.expand(16, -1)  # on sixteen terrains that evolution did not meet
    found = {}
    for body in ("worm-4x1", "worm-7x1", "biped-4x3", "comb-5x2"):
        elsewhere = fitness(replace(config, seed=1000), shape=Morphology.from_name(body))
        found[body] = float(elsewhere(champion, 1).nanmedian())
        print(f"{body}: {found[body]:.2f} m/s")
    return found


if __name__ == "__main__":
    main()
