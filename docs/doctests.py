"""Shows the examples of docstrings as code, wherever in the docstring they stand."""

from __future__ import annotations

from typing import Any

import griffe


class Doctests(griffe.Extension):
    """Puts fences around runs of lines that begin with ``>>>``, up to the next blank line."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Called by griffe for everything that it has read, but modules have no docstring yet."""
        _put_fences(obj)

    def on_module_members(self, *, mod: griffe.Module, **_: Any) -> None:
        """Called by griffe for a module, when it was read to its end."""
        _put_fences(mod)


def _put_fences(obj: griffe.Object) -> None:
    if obj.docstring and ">>>" in obj.docstring.value and "```" not in obj.docstring.value:
        obj.docstring.value = _fenced(obj.docstring.value)


def _fenced(text: str) -> str:
    lines: list[str] = []
    inside = False
    for line in [*text.splitlines(), ""]:
        begins = line.lstrip().startswith(">>>")
        indent = line[: len(line) - len(line.lstrip())]
        if begins and not inside:
            lines.append(f"{indent}```pycon")
            inside = True
        elif inside and not line.strip():
            lines.append(f"{lines[-1][: len(lines[-1]) - len(lines[-1].lstrip())]}```")
            inside = False
        lines.append(line)
    return "\n".join(lines)
