"""How much memory this process holds."""

from __future__ import annotations

import resource
from pathlib import Path

__all__ = ["resident_memory"]


def resident_memory() -> float:
    """Resident memory of this process [MB]."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:  # no Linux: the greatest so far
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    return pages * resource.getpagesize() / 1e6
