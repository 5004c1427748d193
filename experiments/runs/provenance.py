"""Where results come from: command, versions, commit and machine, as a Markdown table."""

from __future__ import annotations

import os
import platform
import shlex
import subprocess
import sys
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

__all__ = ["provenance", "provenance_of"]

_TAG = "provenance/text_summary"
_PACKAGES = ("hebbtorch", "torch", "taichi", "numpy")


def provenance() -> str:
    """A table of the command, the versions, the commit and the machine of this process."""
    program, *arguments = sys.argv or [""]
    facts = {"command": shlex.join([Path(program).name, *arguments]), **_unchanging()}
    rows = [f"| {name} | {value} |" for name, value in facts.items()]
    return "\n".join(["| | |", "|---|---|", *rows])


def provenance_of(folder: Path) -> dict[str, str]:
    """What a run's event files say about where it comes from; nothing if they do not.

    Args:
        folder: The folder of the run.
    """
    for part in (folder, folder / "run-0"):
        if not any(part.glob("events.out.tfevents.*")):
            continue
        events = EventAccumulator(str(part), {"tensors": 0}).Reload()
        if _TAG in events.Tags()["tensors"]:
            table = events.Tensors(_TAG)[-1].tensor_proto.string_val[0].decode()
            cells = [line.strip("| ").split(" | ", 1) for line in table.splitlines()[2:]]
            return {cell[0]: cell[-1] for cell in cells}
    return {}


@cache
def _unchanging() -> dict[str, str]:
    versions = {name: _version(name) for name in _PACKAGES}
    return {
        **versions,
        "python": platform.python_version(),
        "commit": _commit(),
        "system": platform.platform(),
        "processor": _processor(),
        "cores": str(os.cpu_count()),
    }


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def _commit() -> str:
    """The commit of the source, where it is a checkout; with "+" if files were changed."""
    source = Path(__file__).parents[2]
    if not (source / ".git").exists():
        return "not a checkout"
    git = ["git", "-C", str(source)]
    try:
        commit = subprocess.run(
            [*git, "rev-parse", "--short=12", "HEAD"], capture_output=True, text=True, check=True
        )
        changes = subprocess.run(
            [*git, "status", "--porcelain", "--untracked-files=no"], capture_output=True, text=True
        )
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return commit.stdout.strip() + ("+" if changes.stdout.strip() else "")


def _processor() -> str:
    """Its name, as Linux knows it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or "unknown"
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or "unknown"
