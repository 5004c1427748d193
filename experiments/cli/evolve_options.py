"""The options of an evolution as `hebbtorch evolve --help` lists them, under headings."""

from __future__ import annotations

import ast
import dataclasses
import inspect
import textwrap
import typing
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, get_args

import tyro

from experiments.config import EvolveConfig
from experiments.config.options import Group, options_of

__all__ = ["GroupedOptions", "flat"]


def _descriptions(config: type) -> dict[str, str]:
    """The text below each field of a dataclass, which Python itself does not keep."""
    (body,) = ast.parse(textwrap.dedent(inspect.getsource(config))).body
    assert isinstance(body, ast.ClassDef)
    found = {}
    for field, text in zip(body.body, body.body[1:], strict=False):
        match field, text:
            case (
                ast.AnnAssign(target=ast.Name(id=name)),
                ast.Expr(value=ast.Constant(value=str(description))),
            ):
                found[name] = " ".join(description.split())
    return found


def _grouped(config: type) -> type:
    """A dataclass with one dataclass for each group, which the parser gives a box of its own."""
    kinds, texts = typing.get_type_hints(config), _descriptions(config)
    options = options_of(config)
    groups: list[tuple[str, Any, Any]] = []
    for group in get_args(Group):
        fields = [
            (
                field.name,
                Annotated[kinds[field.name], tyro.conf.arg(help=texts[field.name])],
                dataclasses.field(default=field.default),
            )
            for field in dataclasses.fields(config)
            if options[field.name].group == group
        ]
        kind = dataclasses.make_dataclass(group, fields, frozen=True)
        groups.append((group, kind, dataclasses.field(default_factory=kind)))
    return dataclasses.make_dataclass("GroupedOptions", groups, frozen=True)


if TYPE_CHECKING:
    GroupedOptions: TypeAlias = Any
else:
    GroupedOptions = _grouped(EvolveConfig)


def flat(grouped: Any) -> EvolveConfig:
    """The options themselves.

    Args:
        grouped: an instance of `GroupedOptions`.

    Raises:
        ValueError: an option is wrong.
    """
    values: dict[str, Any] = {}
    for group in dataclasses.fields(grouped):
        values |= vars(getattr(grouped, group.name))
    return EvolveConfig(**values)
