"""The thread in which Taichi is started and compiles.

Taichi compiles only in the thread that started it, and any thread may launch what is compiled. So
that a simulator works in whichever thread it is built, one thread that belongs to nobody else does
all of it, and the others wait.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from threading import get_ident
from typing import TypeVar

__all__ = ["CompilerThread"]

_Result = TypeVar("_Result")


class CompilerThread:
    """Runs one call after another, in the order they come; started by the first one.

    The interpreter waits for a call at work before it ends. After a fork the child needs a new one.
    """

    def __init__(self) -> None:
        self._pool = ThreadPoolExecutor(1, "physics-compiler", initializer=self._begin)
        self._ident: int | None = None

    def run(self, call: Callable[[], _Result]) -> _Result:
        """The result of a call, or the exception that it raises."""
        if get_ident() == self._ident:
            return call()
        return self._pool.submit(call).result()

    def _begin(self) -> None:
        self._ident = get_ident()
