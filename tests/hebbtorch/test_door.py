"""The package's front door: what it offers, and the example that it shows."""

import doctest
import importlib
import importlib.resources
import pkgutil
import subprocess
import sys

import pytest
import torch

import hebbtorch

MODULES = [module.name for module in pkgutil.walk_packages(hebbtorch.__path__, prefix="hebbtorch.")]


@pytest.mark.parametrize("name", ["hebbtorch", *MODULES])
def test_the_examples_in_docstrings_run(name):
    module = importlib.import_module(name)
    results = doctest.testmod(module, extraglobs={"hebbtorch": hebbtorch, "torch": torch})
    assert results.failed == 0
    assert results.attempted >= 6 or name != "hebbtorch"


def test_every_public_name_is_there():
    assert [name for name in hebbtorch.__all__ if not hasattr(hebbtorch, name)] == []
    assert all(getattr(hebbtorch, name).__doc__ for name in hebbtorch.__all__)


def test_types_are_published():
    assert importlib.resources.files(hebbtorch).joinpath("py.typed").is_file()


def test_importing_it_loads_no_simulator():
    code = (
        "import sys, hebbtorch; "
        "sys.exit(any(name in sys.modules for name in ('physics', 'experiments', 'taichi')))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
