"""What a comparison is made of: cases to replay, the rows they give, pictures of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from physics import Engine, Morphology, Simulator, Terrain

__all__ = [
    "Case",
    "Check",
    "Outcome",
    "Panel",
    "Picture",
    "SelfAgreement",
    "Setting",
    "Skip",
    "Tolerance",
]

_SYMBOLS = {"at most": "<=", "at least": ">=", "within": "+-"}


@dataclass(frozen=True)
class Tolerance:
    """When a figure of ours is good enough.

    Attributes:
        kind: "at most" or "at least" a value, or "within" it of the reference's figure.
        value: The bound, in the unit of the figure.
    """

    kind: Literal["at most", "at least", "within"]
    value: float

    def admits(self, ours: float, reference: float) -> bool:
        """Whether our figure passes; NaN never does."""
        if self.kind == "at least":
            return ours >= self.value
        return (abs(ours - reference) if self.kind == "within" else ours) <= self.value

    def __str__(self) -> str:
        return f"{_SYMBOLS[self.kind]} {self.value:g}"


@dataclass(frozen=True)
class Check:
    """One figure of ours beside the reference's.

    Attributes:
        case: what was replayed.
        measure: what was measured, with its unit.
        reference: what it is for the recorded run; 0 for an error, 1 for a correlation.
        ours: what it is for our replay.
        tolerance: How far ours may be from it.
        itself: the same figure of the reference against itself with the start shifted by
            1e-6 m, where that was recorded: no simulator can be asked for more.
    """

    case: str
    measure: str
    reference: float
    ours: float
    tolerance: Tolerance
    itself: float | None = None

    @property
    def passes(self) -> bool:
        """Whether ours is within the tolerance."""
        return self.tolerance.admits(self.ours, self.reference)


@dataclass(frozen=True)
class Skip:
    """A case that cannot be replayed with the files at hand.

    Attributes:
        case: what would have been replayed.
        why: what is missing.
    """

    case: str
    why: str


@dataclass(frozen=True)
class SelfAgreement:
    """How well speeds of the reference agree with themselves, and ours with them.

    Each agreement is (Spearman's correlation, mean absolute difference, bias) against the
    reference's plain runs; None where it was not recorded.

    Attributes:
        case: shape, terrain and number type.
        mean: mean speed of the plain runs [m/s].
        shifted: The agreement of the reference with itself from a start shifted by 1e-6 m.
        no_detection: The same of the reference without continuous collision detection.
        ours: The agreement of one run of ours per gait.
    """

    case: str
    mean: float
    shifted: tuple[float, float, float] | None
    no_detection: tuple[float, float, float] | None
    ours: tuple[float, float, float]


@dataclass(frozen=True)
class Panel:
    """One pair of axes with recorded and own data.

    Attributes:
        title, x_label, y_label: The texts above the panel and along its axes.
        kind: "lines": curves over x; "points": ours over recorded, with the diagonal;
            "share": the share of values up to each value.
        recorded, ours: "lines": (T, curves); else (n,).
        x: The values of "lines", (T,).
    """

    title: str
    x_label: str
    y_label: str
    kind: Literal["lines", "points", "share"]
    recorded: np.ndarray
    ours: np.ndarray
    x: np.ndarray = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True)
class Picture:
    """Panels side by side, in one file.

    Attributes:
        name: The name of the file, without its ending.
        panels: The panels from left to right.
    """

    name: str
    panels: tuple[Panel, ...]


@dataclass(frozen=True)
class Setting:
    """What all cases share.

    Attributes:
        engine: settings of the simulator under test.
        seed: The seed of the cases that draw their own motions.
        device: on which it simulates, "cpu" or "cuda".
    """

    engine: Engine = field(default_factory=Engine)
    seed: int = 0
    device: str = "cpu"

    def simulator(
        self,
        shape: str | Morphology,
        terrain: Terrain | Sequence[Terrain] | None,
        n_worlds: int = 1,
        *,
        engine: Engine | None = None,
        **conditions: Any,
    ) -> Simulator:
        """A simulator under test.

        Args:
            shape: See `Simulator`, also for the next two.
            terrain: The ground of the worlds.
            n_worlds: The number of worlds.
            engine: by default the one that all cases share.
            **conditions: other arguments of `Simulator`.
        """
        return Simulator(
            shape,
            terrain,
            n_worlds,
            engine=engine or self.engine,
            device=self.device,
            **conditions,
        )


@dataclass(frozen=True)
class Outcome:
    """What a replay gave."""

    rows: tuple[Check, ...]
    pictures: tuple[Picture, ...] = ()
    self_agreements: tuple[SelfAgreement, ...] = ()


@dataclass(frozen=True)
class Case:
    """A comparison that is ready to run: its files are read and sound.

    Attributes:
        name: The name that the progress shows.
        replay: The function that runs the case.
    """

    name: str
    replay: Callable[[Setting], Outcome]


def worst(errors: np.ndarray) -> float:
    """The largest absolute value; infinite if any is not a number."""
    largest = float(np.abs(errors).max(initial=0.0))
    return math.inf if math.isnan(largest) else largest
