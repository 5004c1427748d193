"""Taichi in this process: when it starts, what it is told, and what happens at a fork."""

from __future__ import annotations

import contextlib
import io
import os
import threading
from typing import Any

import torch

from physics.backend.compile_cache import cache_folder, some_home
from physics.backend.compiler_thread import CompilerThread
from physics.backend.language import NAME, current_program, impl, ti

__all__ = ["Process", "process", "refuse_fork", "running", "start"]


class Process:
    """Taichi in this process.

    Attributes:
        device: "cpu" or "cuda", once it is started.
        program: Taichi's, while it runs; None again after a fork, until the next launch.
        epoch: how often it was started; a compiled kernel belongs to one epoch.
        pid: The id of the process that started it.
        lock: held while it starts, and from before to after a fork.
        compiler: starts and compiles.
    """

    def __init__(self) -> None:
        self.device = ""
        self.program: Any = None
        self.epoch = 0
        self.pid = 0
        self.lock = threading.RLock()
        self.compiler = CompilerThread()


process = Process()


def start(device: str) -> None:
    """Starts Taichi once per process; a second call does nothing.

    A second ``ti.init`` would invalidate every compiled kernel, hence the guards: against other
    code that calls it before or after.

    Args:
        device: "cpu" or "cuda".

    Raises:
        ValueError: this process simulates on the other one already, uses Taichi in another way,
            or is a fork of one that does; or Taichi finds no CUDA.
    """
    refuse_fork()
    if process.device not in ("", device):
        raise ValueError(
            f"device: expected {process.device}, on which this process simulates already, got "
            f"{device}; use a process for each"
        )
    with process.lock:
        running(device)


def refuse_fork() -> None:
    """Refuses a copy of a process that simulates, made by other means than Python's or on a GPU."""
    if process.program is not None and process.pid != os.getpid():
        raise ValueError(
            "process: expected one that was started by itself, got a fork of one that simulates, "
            "whose threads it lacks; start it with the method spawn, such as "
            'multiprocessing.get_context("spawn")'
        )


def running(device: str) -> Any:
    """Taichi's program, started if need be. The caller holds the lock."""
    if process.program is None:
        _start(device)
    program = process.program
    if current_program() is not program:
        raise ValueError(
            "taichi: expected to be the only user of Taichi in this process, but ti.init or "
            "ti.reset was called since, which destroyed the simulator's kernels; use Taichi in a "
            "process of its own"
        )
    return program


def _start(device: str) -> None:
    if current_program() is not None:
        raise ValueError(
            "taichi: expected to start Taichi, but ti.init was called in this process before, and "
            "a second one would destroy its fields; use Taichi in a process of its own"
        )
    if device == "cuda":  # its kernels crash at exit if another thread than the main one ran them
        _init(device)
    else:
        process.compiler.run(lambda: _init(device))
    process.device, process.program = device, current_program()
    process.epoch += 1
    process.pid = os.getpid()


def _init(device: str) -> None:
    """Calls ``ti.init``.

    ``default_fp`` is f64 so that literals keep their digits; kernels cast them to their own
    type. ``cfg_optimization`` is off because it costs compile time for no speed. On a GPU blocks
    of one warp spread few worlds over many multiprocessors, and vectors of one lane must be taken
    apart: Taichi's CUDA has no square root of a vector.
    """
    folder = cache_folder()
    with some_home(folder), contextlib.redirect_stdout(io.StringIO()):  # its greeting
        ti.init(
            arch=ti.cuda if device == "cuda" else ti.cpu,
            default_fp=ti.f64,
            default_ip=ti.i32,
            fast_math=False,
            cfg_optimization=False,
            log_level=ti.WARN,
            real_matrix_scalarize=device == "cuda",
            default_gpu_block_dim=32,
            **({} if NAME == "taichi" else {"offline_cache_file_path": str(folder / NAME)}),
        )
    if device == "cuda" and impl.current_cfg().arch != ti.cuda:  # it only warns of it
        ti.reset()
        raise ValueError(
            'device: expected "cpu", for Taichi finds no CUDA driver it can use, got "cuda"'
        )


def _before_fork() -> None:
    """Ends Taichi, so that the child inherits no trace of threads that it has not.

    Both sides start it again when they need it; the state of worlds is in torch's tensors, and
    kernels come from the cache. A GPU's context does not survive a fork: the child is refused.
    """
    process.lock.acquire()
    program = process.program
    if process.device == "cpu" and program is not None and current_program() is program:
        process.program = None
        del program
        process.compiler.run(_stop)


def _stop() -> None:
    with some_home():
        ti.reset()


def _after_fork_in_child() -> None:
    """The lock and the compiler are those of the parent.

    So are the threads of OpenMP, for which the child would wait for ever: it has one, as the
    workers of PyTorch's DataLoader.
    """
    process.lock = threading.RLock()
    process.compiler = CompilerThread()
    torch.set_num_threads(1)


os.register_at_fork(
    before=_before_fork,
    after_in_parent=lambda: process.lock.release(),
    after_in_child=_after_fork_in_child,
)
