"""The only module that imports taichi: start-up, number types, group-parallel loops.

Taichi 1.7.4 is the last release of its line, so the rest of the package uses a small subset
of the language through the names exported here, and the backend stays replaceable.

Worlds are simulated in groups: every quantity of a group is one vector with a lane per world.
Kernels are strict IEEE (``fast_math=False``): a world's result depends neither on its lane nor on
its neighbours.

``real_matrix_scalarize=False`` keeps these vectors whole down to LLVM's own vector types. Measured
against the default, which takes them apart and leaves it to LLVM to find them again: 2.3 times
the speed, a quarter of the compile time. In this mode Taichi 1.7.4 knows only part of its
operations on vectors; the others abort the process in LLVM. Use on lane vectors ``+ - * /``,
comparisons, ``& | ~`` of masks, ``select``, ``max``, ``min``, ``sqrt``. Write ``0 - x`` for ``-x``,
``x = x - y`` for ``x -= y``, ``numerics.magnitude`` for ``abs``, ``numerics.any_lane`` for ``any``
(which sees lane 0 alone, silently, as ``mask[lane]`` sees nothing); do casts, bits and libm
functions lane by lane (``S[g, item][lane]``).
"""

from __future__ import annotations

import contextlib
import io
import os
import threading
from dataclasses import dataclass
from typing import Any, NamedTuple

import torch

os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")

import taichi as ti

_NARROW, _WIDE = 8, 16  # worlds per group
# A CPU range-for of Taichi is never split below this many iterations, so a loop over chunks runs
# as ``for q in range(GRAIN * chunks): if q % GRAIN == 0: ...  # chunk q // GRAIN``.
GRAIN = 512

_lock = threading.Lock()
_started = False


def start() -> None:
    """Starts Taichi once per process; a second call does nothing.

    A second ``ti.init`` would invalidate every compiled kernel, hence the guard.
    ``default_fp`` is f64 so that literals keep their digits; kernels cast them to their own
    type. ``cfg_optimization`` is off because it costs compile time for no speed.
    """
    global _started
    with _lock:
        if _started:
            return
        with contextlib.redirect_stdout(io.StringIO()):  # its greeting
            ti.init(
                arch=ti.cpu,
                default_fp=ti.f64,
                default_ip=ti.i32,
                fast_math=False,
                cfg_optimization=False,
                log_level=ti.WARN,
                real_matrix_scalarize=False,
            )
        _started = True


class Features(NamedTuple):
    """Stages of the engine that a kernel has only if asked for: each costs time in every step."""

    self_collision: bool = False
    """Squares of a robot collide with each other."""
    continuous: bool = False
    """Squares that land are stopped where they touch the ground."""


_PLAIN = Features()


@dataclass(frozen=True)
class Real:
    """The number type a kernel is built for.

    Attributes:
        f: Taichi's scalar type; ``f(0.1)`` in a kernel is a literal of this type.
        vec: one value per lane.
        lanes: worlds per group.
        double: whether f is float64.
        features: stages of the engine that the kernel has.
    """

    f: Any
    vec: Any
    lanes: int
    double: bool
    features: Features

    @property
    def array(self) -> Any:
        """Kernel argument: (groups, items) of lane vectors, a contiguous torch tensor
        (groups, items, lanes)."""
        return ti.types.ndarray(dtype=self.vec, ndim=2)

    def scalars(self, ndim: int) -> Any:
        """Kernel argument: a contiguous torch tensor of ndim dimensions."""
        return ti.types.ndarray(dtype=self.f, ndim=ndim)


def real(dtype: torch.dtype, lanes: int = _NARROW, features: Features = _PLAIN) -> Real:
    """The Real of a torch dtype.

    Raises:
        ValueError: dtype is neither float32 nor float64.
    """
    if dtype not in (torch.float32, torch.float64):
        raise ValueError(
            f"dtype: expected torch.float32 or torch.float64, got {dtype}; choose one of these"
        )
    double = dtype == torch.float64
    f = ti.f64 if double else ti.f32
    return Real(f, ti.types.vector(lanes, f), lanes, double, features)


def integers(ndim: int) -> Any:
    """Kernel argument: a contiguous int32 torch tensor of ndim dimensions."""
    return ti.types.ndarray(dtype=ti.i32, ndim=ndim)


def lanes_for(n_worlds: int, dtype: torch.dtype, threads: int | None) -> int:
    """The fastest number of worlds per group; results do not depend on it.

    Sixteen float32 worlds fill the widest vectors and run 1.4 times as fast as twice eight, if
    they leave every thread a group of its own; in float64 eight already fill them.
    """
    groups = -(-n_worlds // _WIDE)
    wide = dtype == torch.float32 and n_worlds > _NARROW and groups >= _available(threads)
    return _WIDE if wide else _NARROW


def chunks(groups: int, threads: int | None) -> int:
    """Into how many chunks a parallel loop over groups is cut: one per thread that runs."""
    return max(1, min(groups, _available(threads)))


def _available(threads: int | None) -> int:
    """Threads that may run: as many as asked for, or as this process has cores."""
    if threads is not None:
        return threads
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
