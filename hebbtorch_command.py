"""Where the console script `hebbtorch` starts.

A module with a name of its own, because `experiments` is a name that research code often has too:
whatever folder `experiments/` a user keeps beside their work or on PYTHONPATH, the command runs
the one that was installed together with this file.
"""

from __future__ import annotations

import importlib.machinery
import importlib.util
import sys
from pathlib import Path

__all__ = ["main"]


def main() -> None:
    """Runs the command line."""
    _use_own_experiments()
    from experiments.cli import main as command_line

    command_line()


def _use_own_experiments() -> None:
    """Makes `import experiments` mean the folder beside this file.

    Without an ``__init__.py`` it would otherwise give way to a regular package of the same name
    anywhere on the path. The folder comes first on the path too, for processes started from here.
    """
    here = Path(__file__).resolve().parent
    sys.path.insert(0, str(here))
    spec = importlib.machinery.ModuleSpec("experiments", None, is_package=True)
    spec.submodule_search_locations = [str(here / "experiments")]
    sys.modules["experiments"] = importlib.util.module_from_spec(spec)
