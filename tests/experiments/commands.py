"""The command line, within this process."""

import pytest

from experiments import cli


def hebbtorch(command: str, monkeypatch: pytest.MonkeyPatch) -> int:
    """The exit code of `hebbtorch <command>`."""
    monkeypatch.setattr("sys.argv", ["hebbtorch", *command.split()])
    try:
        cli.main()
    except SystemExit as stop:
        return int(stop.code or 0)
    return 0
