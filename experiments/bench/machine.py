"""What the figures were measured on."""

from __future__ import annotations

import os
import platform
import shlex
import sys
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

__all__ = ["Machine", "available_cores"]

_CPUINFO = Path("/proc/cpuinfo")


@dataclass(frozen=True)
class Machine:
    """A machine and the programs on it.

    Attributes:
        cpu: name of the processor.
        cores: that this process may use.
        python, torch, taichi: The versions of these.
        date: now, in UTC.
        command: line of this process.
    """

    cpu: str
    cores: int
    python: str
    torch: str
    taichi: str
    date: str
    command: str

    @classmethod
    def here(cls) -> Machine:
        """This machine, now."""
        return cls(
            cpu=_cpu_name(),
            cores=available_cores(),
            python=platform.python_version(),
            torch=version("torch"),
            taichi=version("taichi"),
            date=datetime.now(UTC).isoformat(timespec="seconds"),
            command=shlex.join([Path(sys.argv[0]).name, *sys.argv[1:]]),
        )

    def as_dict(self) -> dict[str, str | int]:
        """The attributes by name."""
        return asdict(self)


def available_cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _cpu_name() -> str:
    """As the system calls it, with the widest vectors that it knows."""
    if not _CPUINFO.is_file():
        return platform.processor() or platform.machine()
    fields: dict[str, str] = {}
    for line in _CPUINFO.read_text(encoding="utf-8").splitlines():
        key, _, value = line.partition(":")
        fields.setdefault(key.strip(), value.strip())
    name = fields.get("model name") or platform.machine()
    flags = fields.get("flags", "").split()
    vectors = next((flag for flag in ("avx512f", "avx2") if flag in flags), None)
    return f"{name} ({vectors})" if vectors else name
