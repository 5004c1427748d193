"""The command line, `hebbtorch <command>`."""

from experiments.cli.main import main

__all__ = ["main"]
