"""The entry: from sys.argv to an exit code.

Commands import what they need when they run, so that --help answers at once.
"""

from __future__ import annotations

import contextlib
import logging
import sys
from importlib.metadata import version

from experiments.cli import campaign_commands, check_commands, process, run_commands
from experiments.cli.parser import read_arguments
from experiments.io import terminal

__all__ = ["main"]

_SYSTEM_ERROR, _USAGE_ERROR, _INTERRUPTED, _TERMINATED = 1, 2, 130, 143
_QUIET = ("--quiet", "-q")
_DESCRIPTION = """Evolve controllers of soft robots whose synapses change while they act.

Every command takes --quiet (-q): nothing but warnings and errors. `hebbtorch --version` prints
the version; with NO_COLOR set, nothing is coloured."""

_COMMANDS = (
    *run_commands.COMMANDS,
    *campaign_commands.COMMANDS,
    *check_commands.COMMANDS,
)


def main() -> None:
    """Run the command that sys.argv names. A user's mistake is one line and exit code 2.

    Besides the commands, --version and --quiet are known, the latter anywhere among the options.
    """
    process.prepare()
    arguments = sys.argv[1:]
    quiet = [each for each in arguments if each in _QUIET]
    arguments = [each for each in arguments if each not in _QUIET]
    logging.basicConfig(format="%(message)s", level=logging.WARNING)
    try:
        if arguments == ["--version"]:
            print(f"hebbtorch {version('hebbtorch')}")
            return
        command = read_arguments(_COMMANDS, arguments or ["--help"], _DESCRIPTION)
        with terminal.quiet() if quiet else contextlib.nullcontext():
            command()
    except ValueError as error:
        print(f"hebbtorch: {error}", file=sys.stderr)
        sys.exit(_USAGE_ERROR)
    except OSError as error:
        print(f"hebbtorch: {error}", file=sys.stderr)
        sys.exit(_SYSTEM_ERROR)
    except process.Terminated:
        sys.exit(_TERMINATED)
    except KeyboardInterrupt:
        sys.exit(_INTERRUPTED)
