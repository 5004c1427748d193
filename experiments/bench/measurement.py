"""Lines of the tables: a figure, measured several times, and a part of a robot-step."""

from __future__ import annotations

import statistics
from dataclasses import dataclass, replace
from typing import Literal

__all__ = ["Measurement", "Stage", "Target", "Verdict"]

Verdict = Literal["aim", "reached", "MISSED"]


@dataclass(frozen=True)
class Target:
    """What a figure should be.

    Attributes:
        bound: what it must reach.
        aim: what would be good.
    """

    bound: float
    aim: float | None = None


@dataclass(frozen=True)
class Measurement:
    """A figure.

    Attributes:
        what: What is measured.
        unit: The unit of the figure.
        samples: one per repetition; at least one.
        more_is_better: whether it is a rate or share; else it is a cost.
        baseline: the same figure of the program it is compared with.
        target: if there is one.
        others: cores that other processes took meanwhile, at most; None: not known.
    """

    what: str
    unit: str
    samples: tuple[float, ...]
    more_is_better: bool = True
    baseline: float | None = None
    target: Target | None = None
    others: float | None = None

    @property
    def median(self) -> float:
        """The figure that counts."""
        return statistics.median(self.samples)

    @property
    def best(self) -> float:
        """The figure with the least disturbance by other jobs."""
        return max(self.samples) if self.more_is_better else min(self.samples)

    @property
    def quartiles(self) -> tuple[float, float]:
        """Lower and upper."""
        if len(self.samples) == 1:
            return self.samples[0], self.samples[0]
        low, _, high = statistics.quantiles(self.samples, n=4, method="inclusive")
        return low, high

    @property
    def ratio(self) -> float | None:
        """The median over the baseline."""
        return None if self.baseline is None else self.median / self.baseline

    @property
    def verdict(self) -> Verdict | None:
        """Whether the median reaches the target, or even the aim."""
        if self.target is None:
            return None
        if self.target.aim is not None and self._reaches(self.target.aim):
            return "aim"
        return "reached" if self._reaches(self.target.bound) else "MISSED"

    def joined(self, again: Measurement) -> Measurement:
        """This row and the same, measured again."""
        known = [row.others for row in (self, again) if row.others is not None]
        return replace(self, samples=self.samples + again.samples, others=max(known, default=None))

    def _reaches(self, figure: float) -> bool:
        return self.median >= figure if self.more_is_better else self.median <= figure


@dataclass(frozen=True)
class Stage:
    """A part of the work.

    Attributes:
        name: The name of the part.
        microseconds: CPU time per robot-step [us].
    """

    name: str
    microseconds: float
