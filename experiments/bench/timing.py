"""Process CPU time, which other jobs of the machine lengthen less than the time on the wall."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path

__all__ = ["OtherProcesses", "cpu_seconds", "cpu_seconds_each"]

_STAT = Path("/proc/stat")
_BUSY = (1, 2, 3, 6, 7)  # user, nice, system, irq, softirq in its first line


def cpu_seconds(call: Callable[[], object]) -> float:
    """CPU time of one call, all threads of this process together [s]."""
    started = time.process_time()
    call()
    return time.process_time() - started


def cpu_seconds_each(prepare: Callable[[], Callable[[], object]], times: int) -> list[float]:
    """CPU time of calls, each made ready by `prepare` outside the measurement [s]."""
    return [cpu_seconds(prepare()) for _ in range(times)]


class OtherProcesses:
    """How many cores the other processes of the machine take, from its making on."""

    def __init__(self) -> None:
        self._wall = time.perf_counter()
        self._busy = _busy_seconds()
        self._own = _own_seconds()

    def cores(self) -> float | None:
        """Cores that others took on average until now; None where the system does not tell."""
        busy = _busy_seconds()
        if busy is None or self._busy is None:
            return None
        others = (busy - self._busy) - (_own_seconds() - self._own)
        return max(0.0, others / (time.perf_counter() - self._wall))


def _busy_seconds() -> float | None:
    """CPU time of all processes since the machine started [s]."""
    if not _STAT.is_file():
        return None
    fields = _STAT.read_text(encoding="utf-8").split("\n", 1)[0].split()
    return sum(int(fields[k]) for k in _BUSY) / os.sysconf("SC_CLK_TCK")


def _own_seconds() -> float:
    """CPU time of this process and of those that it started and that have ended [s]."""
    return sum(os.times()[:4])
