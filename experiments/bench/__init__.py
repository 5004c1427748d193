"""Measures how fast everything runs, and compares it with recorded baselines.

Every module measures one kind of thing and gives rows of the table; ``RESULTS.md`` holds a table
of one machine and says what each row means and what limits it.
"""

from experiments.bench.benchmark import bench

__all__ = ["bench"]
