"""Grids of conditions: options and their values, expanded into every combination.

A condition is an evolution with all its seeds. Its name is made of the options that differ from
the paper's, so that studies that need the same condition name it alike and share its run.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from experiments.config import EvolveConfig
from experiments.config.options import options_of

__all__ = [
    "MACHINE_OPTIONS",
    "QUICK",
    "SCALE_OPTIONS",
    "Condition",
    "Grid",
    "Scale",
    "condition_name",
]


@dataclass(frozen=True)
class Scale:
    """How much of everything: the same for all conditions of a campaign; defaults: the paper's."""

    runs: int = 10
    """Independent runs of each condition."""

    generations: int = 500
    """Populations that each run evaluates."""

    population: int = 40
    """Individuals per generation."""

    duration: float = 60.0
    """Length of an episode [s]."""

    seed: int = 0
    """Everything random follows from it; run r of a condition has seed + r."""

    def validate(self) -> None:
        """Check every number.

        Raises:
            ValueError: the first that is wrong.
        """
        dataclasses.replace(EvolveConfig(), **dataclasses.asdict(self)).validate()


QUICK = Scale(runs=2, generations=2, population=8, duration=2.0)
"""The scale of --quick: enough to see that everything works, too little to learn from."""

SCALE_OPTIONS = tuple(options_of(EvolveConfig, "scale", "sample"))
MACHINE_OPTIONS = tuple(options_of(EvolveConfig, "machine"))
_ALWAYS_NAMED = ("shape", "sensors", "controller")


@dataclass(frozen=True)
class Condition:
    """One evolution of a campaign, all its seeds in one batch.

    Attributes:
        name: The name of its folder, see `condition_name`.
        config: the options, validated.
    """

    name: str
    config: EvolveConfig


@dataclass(frozen=True)
class Grid:
    """Every combination of some values of some options.

    Attributes:
        base: the options that all conditions have in common; its scale does not matter.
        axes: values of the options that vary, the slowest first.
    """

    base: EvolveConfig = field(default_factory=EvolveConfig)
    axes: Mapping[str, Sequence[str | float | bool | None]] = field(default_factory=dict)

    def expand(self, scale: Scale) -> list[Condition]:
        """All conditions, validated.

        Args:
            scale: The scale of every condition.

        Raises:
            ValueError: an option or a value is wrong, or values do not fit together.
        """
        self._check()
        base = dataclasses.replace(self.base, **dataclasses.asdict(scale))
        return [_condition(base, values) for values in self._combinations()]

    def _combinations(self) -> Iterator[dict[str, Any]]:
        for values in itertools.product(*self.axes.values()):
            yield dict(zip(self.axes, values, strict=True))

    def _check(self) -> None:
        check_options("axes", self.axes)
        for option, values in self.axes.items():
            if isinstance(values, str) or not isinstance(values, Sequence) or not len(values):
                raise ValueError(f"{option}: expected a list of values, got {values!r}")
            for value in values:
                check_value(option, value)
            if len(set(values)) < len(values):
                raise ValueError(f"{option}: expected every value once, got {list(values)!r}")


def condition_name(config: EvolveConfig) -> str:
    """The name of a condition: shape, sensors, controller, and what differs from the paper.

    Conditions of one scale have the same name exactly if they have the same options.
    """
    paper = EvolveConfig()
    suffixes = [
        what.suffix(getattr(config, name))
        for name, what in options_of(EvolveConfig, "axis", "variant").items()
        if name not in _ALWAYS_NAMED and getattr(config, name) != getattr(paper, name)
    ]
    return "-".join([*(getattr(config, name) for name in _ALWAYS_NAMED), *suffixes])


def check_options(where: str, options: Mapping[str, Any]) -> None:
    """Refuse what is no option of a condition.

    Args:
        where: what to call their place.
        options: The options by name.

    Raises:
        ValueError: a name is unknown, or belongs to the scale or to the machine.
    """
    known = [each.name for each in dataclasses.fields(EvolveConfig)]
    own = [name for name in known if name not in (*SCALE_OPTIONS, *MACHINE_OPTIONS)]
    for name in options:
        if name in SCALE_OPTIONS:
            raise ValueError(
                f"{where}: expected no {name}, which is the same for a whole campaign; give it "
                f"as --{name}"
            )
        if name not in own:
            raise ValueError(f"{where}: expected some of {', '.join(own)}, got {name!r}")


def check_value(option: str, value: Any) -> None:
    """Refuse a value that is not even of the kind of the option's default.

    Raises:
        ValueError: text in place of a number, or the reverse.
    """
    default = getattr(EvolveConfig(), option)
    if value is None and default is None:
        return
    if isinstance(default, bool):
        if not isinstance(value, bool):
            raise ValueError(f"{option}: expected true or false, got {value!r}")
        return
    is_text = default is None or isinstance(default, str)
    kinds = (str,) if is_text else (str, int, float)
    if not isinstance(value, kinds) or isinstance(value, bool):
        words = "text" if is_text else "a number"
        raise ValueError(f"{option}: expected {words}, got {value!r}")


def _condition(base: EvolveConfig, values: dict[str, Any]) -> Condition:
    config = dataclasses.replace(base, **values)
    try:
        config.validate()
    except ValueError as error:
        place = ", ".join(f"{option} {value}" for option, value in values.items())
        raise ValueError(f"grid at {place or 'its base'}: {error}") from None
    return Condition(condition_name(config), config)
