"""What runs when the script of a study is started by itself."""

from __future__ import annotations

import sys
from importlib.metadata import entry_points

from experiments.campaign.study import Study

__all__ = ["main"]


def main(study: Study) -> None:
    """Run `hebbtorch campaign STUDY` with the arguments of this process."""
    (command,) = entry_points(group="console_scripts", name="hebbtorch")
    sys.argv[1:1] = ["campaign", study.name]
    command.load()()
