"""How Taichi reads a kernel, so that little is left for it to compile.

Where a vector meets a scalar, Taichi writes the scalar out for every lane, with all that it is
computed from: of the 25,000 statements that it made of one kernel, 11,000 were constants. Then it
merges equal ones, and for each that it merges it walks through the whole kernel twice, which was
nine tenths of the time to compile it. While a kernel is read in `lean`, a scalar beside a vector is
computed once, and constants that every stage needs stand at the head of the loop over groups.
What the kernel computes, and how fast, is the same.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from importlib import import_module
from typing import Any

from physics.backend.language import NAME, impl, reader, ti

__all__ = ["keep_constants", "lane_of", "lean"]

_INTEGERS = range(-1, 65)  # numbers of items, of lanes, of bodies
_VECTORS = (0.0, 1.0, -1.0)


class _Kept:
    """The constants at the head of a kernel.

    Attributes:
        kernel: the kernel that has them.
        true: a variable that is.
        integers: variables by value.
        vectors: variables by type and value.
    """

    def __init__(self) -> None:
        self.kernel: Any = None
        self.true: Any = None
        self.integers: dict[int, Any] = {}
        self.vectors: dict[tuple[str, float], Any] = {}

    def integer(self, value: Any) -> Any:
        """The variable of a Python integer, or the value as it is."""
        if type(value) is int and self.kernel is _compiled():
            return self.integers.get(value, value)
        return value

    def vector(self, dtype: Any, value: Any) -> Any:
        """The variable of a vector of equal numbers, if there is one."""
        if isinstance(value, int | float) and self.kernel is _compiled():
            return self.vectors.get((str(dtype), value))
        return None


_kept = _Kept()


def keep_constants(lanes: int, real: Any) -> int:
    """In a kernel: declares, for what follows in this block, the constants that it often needs.

    Args:
        lanes: of its vectors.
        real: Taichi's type of its numbers.

    Returns:
        How many.
    """
    _kept.kernel = None
    if NAME != "taichi" or lanes == 1:
        return 0
    vectors = [(real, value) for value in _VECTORS] + [(ti.i32, value) for value in (0, 1)]
    _kept.true = _chosen(_true(), _true())
    _kept.vectors = {
        (str(dtype), value): impl.expr_init(ti.types.vector(lanes, dtype)(value))
        for dtype, value in vectors
    }
    masks = (2**31 // lanes - 1,)  # of addresses, see `groups`
    _kept.integers = {value: _hidden(_expression(value)) for value in (*_INTEGERS, *masks)}
    _kept.kernel = _compiled()
    return len(_kept.vectors) + len(_kept.integers)


def lane_of(vector: Any, lane: int) -> Any:
    """In a kernel: a number of a vector."""
    return impl.subscript(None, vector, _kept.integer(lane))


@contextlib.contextmanager
def lean() -> Iterator[None]:
    """Reads kernels so, if they are Taichi's.

    It also lets Taichi name file and line of what it reads, and leave out the text of the line:
    it makes that text for every expression, for the message of an error that may come, which
    takes two thirds of its time before a compiled kernel is found in the cache.
    """
    ops, matrix = _module("ops"), _module("matrix")
    binary, ternary, both = ops._binary_operation, ops._ternary_operation, ops.logical_and
    vector = matrix.VectorType.__call__
    core = ops._ti_core
    # Not those that Taichi translates otherwise if it sees a constant: quotients and remainders.
    plain = [core.expr_add, core.expr_sub, core.expr_mul, core.expr_bit_and, core.expr_bit_or]
    plain += [core.expr_cmp_lt, core.expr_cmp_le, core.expr_cmp_gt, core.expr_cmp_ge]
    plain += [core.expr_cmp_eq, core.expr_cmp_ne]

    def lean_binary(operation: Any, in_python: Any, *values: Any) -> Any:
        return binary(operation, in_python, *_once(values, operation in plain))

    def lean_ternary(operation: Any, in_python: Any, *values: Any) -> Any:
        return ternary(operation, in_python, *_once(values))

    def lean_both(a: Any, b: Any) -> Any:
        return b if a is True else both(a, b)  # with which each comparison begins

    def lean_vector(self: Any, *values: Any) -> Any:
        number = int | float | _expression_type()
        if len(values) == 1 < self.n and isinstance(values[0], number):
            known = _kept.vector(self.dtype, values[0])
            if known is not None:
                return known
            if not _expression(values[0]).is_tensor():
                values = (_hidden(ops.cast(_expression(values[0]), self.dtype)),)
        return vector(self, *values)

    def place(self: Any, node: Any) -> str:
        line = node.lineno + self.lineno_offset
        return f'File "{self.file}", line {line}, in {self.func.func.__name__}:\n'

    with (
        _changed(ops, "_binary_operation", lean_binary),
        _changed(ops, "_ternary_operation", lean_ternary),
        _changed(ops, "logical_and", lean_both),
        _changed(matrix.VectorType, "__call__", lean_vector),
        _changed(reader(), "get_pos_info", place),
    ):
        yield


def _once(values: tuple[Any, ...], integers: bool = False) -> tuple[Any, ...]:
    """Operands, of which those that are scalars beside vectors are variables.

    Args:
        values: Python numbers and expressions.
        integers: whether integers may be variables, too.
    """
    if not any(isinstance(value, _expression_type()) for value in values):
        return values
    expressions = [_expression(_kept.integer(v) if integers else v) for v in values]
    tensors = [each.is_tensor() for each in expressions]
    if not any(tensors):
        return tuple(expressions)
    return tuple(
        each if tensor else _hidden(each) for each, tensor in zip(expressions, tensors, strict=True)
    )


def _hidden(value: Any) -> Any:
    """A variable with the value of a scalar, of which Taichi does not see that it is constant.

    It copies a constant for each use of it. LLVM sees through the choice between equal values.
    """
    true = _kept.true if _kept.kernel is _compiled() else _true()
    return _chosen(true, impl.expr_init(value))


def _chosen(condition: Any, value: Any) -> Any:
    """A variable with a value if a condition holds, and else with the same one."""
    select = _module("ops")._ti_core.expr_select
    return impl.expr_init(_expression_type()(select(condition.ptr, value.ptr, value.ptr)))


def _true() -> Any:
    return _module("expr").make_constant_expr(True, ti.u1)


def _expression(value: Any) -> Any:
    return value if isinstance(value, _expression_type()) else _expression_type()(value)


def _expression_type() -> Any:
    return _module("expr").Expr


def _compiled() -> Any:
    """The kernel that is read."""
    return impl.get_runtime().compiling_callable


def _module(name: str) -> Any:
    return import_module(f"{NAME}.lang.{name}")


@contextlib.contextmanager
def _changed(owner: Any, name: str, value: Any) -> Iterator[None]:
    """Sets an attribute for a while."""
    before = getattr(owner, name)
    setattr(owner, name, value)
    try:
        yield
    finally:
        setattr(owner, name, before)
