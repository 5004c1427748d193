"""What an option of an evolution is: its role, its short names, and which controllers have it.

`EvolveConfig` states it once with each field; the names of conditions, the legends of figures and
the checks read it from there.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

__all__ = [
    "PLASTIC",
    "STATIC",
    "Group",
    "Option",
    "Role",
    "noise_option",
    "option",
    "options_of",
    "plastic_option",
    "world_option",
]

Role = Literal["axis", "variant", "scale", "sample", "machine"]
"""What an option is about:

- "axis": body, sensors, controller and damage, by which figures are laid out;
- "variant": anything else that makes another condition;
- "scale": how much is computed; runs of different scales cannot be compared;
- "sample": which runs of a condition;
- "machine": how they are computed, which changes no result.
"""

Group = Literal["robot", "controller", "plasticity", "world", "evolution", "computation"]
"""The headings under which the command line lists options."""

Words = str | Mapping[Any, str] | Callable[[Any], str]
"""What to call a value: words with {} in its place; the names of some values, others being called
as they are written; or a function."""

PLASTIC, STATIC = ("hebbian",), ("mlp", "rnn")  # controllers with and without plasticity
_KEY = "option"


@dataclass(frozen=True)
class Option:
    """What an option is.

    Attributes:
        role: See `Role`.
        group: See `Group`.
        suffix: What a value other than the default adds to the name of a condition's folder.
        label: What it is called in legends and tables.
        controllers: The controllers that have this option; empty: all.
        least: The least number that it can be; None: it is no number, or any.
    """

    role: Role
    group: Group
    suffix: Callable[[Any], str] = str
    label: Callable[[Any], str] = str
    controllers: tuple[str, ...] = ()
    least: float | None = None


def option(
    default: Any,
    role: Role,
    *,
    group: Group,
    suffix: Words = str,
    label: Words = str,
    controllers: tuple[str, ...] = (),
    least: float | None = None,
) -> Any:
    """A field of `EvolveConfig`.

    Args:
        default: The paper's value.
        role: See `Role`.
        group: See `Group`.
        suffix: As in `Option`, see `Words`.
        label: As in `Option`, see `Words`.
        controllers: As in `Option`.
        least: As in `Option`.
    """
    what = Option(role, group, _in_words(suffix), _in_words(label), controllers, least)
    return dataclasses.field(default=default, metadata={_KEY: what})


def plastic_option(default: Any, **others: Any) -> Any:
    """An option of plastic networks alone; arguments as those of `option`."""
    return option(default, "variant", group="plasticity", controllers=PLASTIC, **others)


def world_option(default: Any, **others: Any) -> Any:
    """An option of the physics; arguments as those of `option`."""
    return option(default, "variant", group="world", **others)


def noise_option(kind: str) -> Any:
    """An option of the noise of one kind of sensor, such as "lidar"."""
    return option(
        None,
        "variant",
        group="robot",
        suffix=lambda value: f"noise-{kind}-{float(value)}",
        label=f"noise {{}} of {kind}",
        least=0.0,
    )


def _in_words(words: Words) -> Callable[[Any], str]:
    if isinstance(words, str):
        return words.format
    if isinstance(words, Mapping):
        return lambda value: words.get(value, str(value))
    return words


def options_of(config: type, *roles: Role) -> dict[str, Option]:
    """The options of a class of options, by name and in its order.

    Args:
        config: A dataclass whose fields `option` made.
        roles: The roles wanted; none: all.
    """
    found = {field.name: field.metadata[_KEY] for field in dataclasses.fields(config)}
    return {name: each for name, each in found.items() if not roles or each.role in roles}
