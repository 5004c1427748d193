"""From words on the command line to a call; what is wrong with them in one line."""

from __future__ import annotations

import contextlib
import functools
import inspect
import io
from collections.abc import Callable, Sequence
from typing import Any

import tyro
from tyro.extras import SubcommandApp

__all__ = ["read_arguments"]

Command = Callable[..., None]

_FRAME = "│╭╮╰╯─ "  # what tyro draws around its complaints
_TITLE = "╭"
_EXAMPLES = "For example:"


def read_arguments(
    commands: Sequence[Command], arguments: Sequence[str], description: str
) -> Callable[[], None]:
    """The command that is asked for, with its arguments.

    Args:
        commands: All there are.
        arguments: Words of the command line, the name of the command first.
        description: What all of them are for, for the help.

    Raises:
        ValueError: the words are not a command with its arguments.
        SystemExit: help was asked for, and shown.
    """
    complaint = io.StringIO()
    try:
        with contextlib.redirect_stderr(complaint):
            call: Callable[[], None] = _app(commands, arguments[0]).cli(
                prog="hebbtorch",
                description=description,
                args=arguments,
                config=(tyro.conf.OmitArgPrefixes,),
            )
    except SystemExit as stop:
        if stop.code and complaint.getvalue():
            raise ValueError(_one_line(complaint.getvalue())) from None
        raise
    return call


def _app(commands: Sequence[Command], chosen: str) -> SubcommandApp:
    """All commands. The arguments are read first, and a command runs when all of them are.

    Args:
        commands: What to register.
        chosen: The command whose help shows its examples; the list of commands shows none.
    """
    app = SubcommandApp()
    for function in commands:

        def read(*args: Any, _call: Command = function, **kwargs: Any) -> Any:
            if kwargs.get("seed", 0) < 0:
                raise ValueError(f"seed: expected an integer >= 0, got {kwargs['seed']}")
            return functools.partial(_call, *args, **kwargs)

        functools.update_wrapper(read, function)
        if function.__name__ != chosen:
            paragraphs = (inspect.getdoc(function) or "").split("\n\n")
            read.__doc__ = "\n\n".join(p for p in paragraphs if not p.startswith(_EXAMPLES))
        app.command(read)
    return app


def _one_line(complaint: str) -> str:
    """What tyro says is wrong, without the frame that it draws around it.

    Its versions have no common way to be asked for the words alone.
    """
    parts: list[list[str]] = [[]]
    for line in complaint.splitlines():
        words = line.strip(_FRAME)
        if words and not line.startswith(_TITLE):
            parts[-1].append(words)
        elif parts[-1]:
            parts.append([])
    return "; ".join(" ".join(part).rstrip(".") for part in parts if part)
