"""What trials of environments count; without gymnasium there are none."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

__all__ = ["EpisodeCounts"]


@dataclass
class EpisodeCounts:
    """What was seen of the environments.

    Attributes:
        trials: Vector environments.
        steps: Robot-steps.
        resets: Episodes that were begun in the middle of others.
        faults: How many worlds did what none should do, by what it was.
        memory: Resident memory after every 20th trial [MB].
        examples: The first trials with a fault, to repeat them.
    """

    trials: int = 0
    steps: int = 0
    resets: int = 0
    faults: Counter[str] = field(default_factory=Counter)
    memory: list[float] = field(default_factory=list)
    examples: list[str] = field(default_factory=list)
