"""Compiled kernels, and their launch."""

from __future__ import annotations

from typing import Any

from torch import Tensor

from physics.backend.compile_cache import some_home
from physics.backend.language import NAME
from physics.backend.process import process, refuse_fork, running
from physics.backend.reading import lean

__all__ = ["Kernel"]

_MOST = 2**31 - 1  # numbers in a tensor


class Kernel:
    """A compiled kernel that is launched with little ado.

    Taichi looks at every argument of every launch for some ten microseconds. Ours are always of
    the same kinds, so that it is enough if it looks at those of the first launch; later ones only
    hand it the pointers that have changed. On 400 worlds this is a tenth of a control step.

    Args:
        function: decorated with ``ti.kernel``; its arguments are tensors and integers.
    """

    def __init__(self, function: Any) -> None:
        self._function = function
        self._epoch = 0  # in which it was compiled

    def __call__(self, *arguments: Tensor | int) -> None:
        """Launch it.

        Args:
            arguments: contiguous tensors and integers as in its declaration.

        Raises:
            ValueError: a tensor is too large for Taichi.
        """
        for value in arguments:
            if isinstance(value, Tensor) and value.numel() > _MOST:
                raise ValueError(
                    f"tensor: expected at most {_MOST} numbers, which Taichi counts in 32 bits, "
                    f"got shape {tuple(value.shape)}; give fewer worlds, or fewer steps, at once"
                )
        refuse_fork()
        with process.lock:
            self._launch(*arguments)

    def _launch(self, *arguments: Tensor | int) -> None:
        program = running(process.device)
        if NAME != "taichi":
            process.compiler.run(lambda: self._function(*arguments))
            return
        if self._epoch != process.epoch:
            if process.device == "cpu":
                process.compiler.run(lambda: self._first_launch(*arguments))
            else:
                self._first_launch(*arguments)
            return
        if process.device == "cuda":  # there a launch uses its context up
            self._begin_context(len(arguments))
        for place, value in enumerate(arguments):
            if isinstance(value, int):
                if self._given[place] != value:
                    self._given[place] = value
                    self._context.set_arg_int((place,), value)
                continue
            memory = value.data_ptr(), value.shape
            if self._given[place] != memory:
                assert value.is_contiguous()
                self._given[place] = memory
                shape = value.shape[: value.dim() - self._element_dims[place]]
                self._context.set_arg_external_array_with_shape(
                    (place,), memory[0], value.nbytes, shape, 0
                )
        program.launch_kernel(self._compiled, self._context)

    def _first_launch(self, *arguments: Tensor | int) -> None:
        """Lets Taichi compile and launch it, and keeps what later launches need."""
        with lean(), some_home():
            self._function(*arguments)
            primal = self._function._primal
            (self._kernel,) = primal.compiled_kernels.values()
            program = process.program
            self._compiled = program.compile_kernel(
                program.config(), program.get_device_caps(), self._kernel
            )
        kinds = (getattr(each.annotation, "dtype", None) for each in primal.arguments)
        self._element_dims = [getattr(kind, "ndim", 0) for kind in kinds]
        self._begin_context(len(arguments))
        self._epoch = process.epoch

    def _begin_context(self, arguments: int) -> None:
        """Makes a context for launches, and notes that no argument was handed to it."""
        self._context = self._kernel.make_launch_context()
        self._given: list[Any] = [None] * arguments
