"""What an evolution is: its options, what each of them means, and their checks."""

from experiments.config.evolve_config import EvolveConfig

__all__ = ["EvolveConfig"]
