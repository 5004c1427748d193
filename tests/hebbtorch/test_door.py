"""The package's front door: what it offers, and the example that it shows."""

import doctest
import importlib.resources
import subprocess
import sys

import hebbtorch


def test_the_example_in_the_docstring_runs():
    results = doctest.testmod(hebbtorch)
    assert results.attempted >= 6
    assert results.failed == 0


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
