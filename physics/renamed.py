"""Modules of version 0.1 under their old names: they work until version 0.3, and warn.

What is public is what `__all__` of `physics` and `physics.envs` lists; before these names were all
that there is, programs had to name modules.
"""

from __future__ import annotations

import importlib
import sys
import warnings
from types import ModuleType
from typing import Any

__all__ = ["keep_old_names", "moved"]

_MODULES = {
    "apparatus": "scene.sensors",
    "clock": "scene.clock",
    "damage": "scene.damage",
    "material": "scene.material",
    "morphology": "scene.morphology",
    "terrain": "scene.terrain",
    "canvas": "render.canvas",
    "frame": "render.frame",
    "movie": "render.movie",
    "palette": "render.palette",
}


def moved(old: str, new: str, name: str) -> Any:
    """What is asked for under the name of a module that has moved.

    Args:
        old: name of the module that was asked.
        new: name of the module that has it.
        name: what was asked for.

    Raises:
        AttributeError: there is no such thing.
    """
    if name.startswith("__"):  # asked by the import system and by tools, not by programs
        raise AttributeError(f"module {old!r} has no attribute {name!r}")
    found = getattr(importlib.import_module(new), name)
    words = f"{old}.{name} is now {new}.{name}; the old name goes with version 0.3"
    warnings.warn(words, DeprecationWarning, stacklevel=3)
    return found


def keep_old_names(package: ModuleType) -> None:
    """Let the old names of a package's modules be imported."""
    for old, new in _MODULES.items():
        module = _Old(f"{package.__name__}.{old}", f"{package.__name__}.{new}")
        sys.modules[module.__name__] = module
        setattr(package, old, module)


class _Old(ModuleType):
    """A module that has nothing but another name."""

    def __init__(self, old: str, new: str) -> None:
        super().__init__(old, f"Old name of `{new}`.")
        self.__new = new

    def __getattr__(self, name: str) -> Any:
        return moved(self.__name__, self.__new, name)
