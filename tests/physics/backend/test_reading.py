"""How kernels are read: the same results, and Taichi as it was afterwards."""

import pytest
import torch

from physics.backend import NAME, Features, Kernel, Program, reading, real, start, ti

LANES = 4

pytestmark = pytest.mark.skipif(NAME != "taichi", reason="reads kernels itself")


def kernel_of_constants(constants: bool) -> Kernel:
    """y = each constant and mask beside a vector, one row for each kind."""
    start("cpu")
    T = real(Program(torch.float32, LANES, LANES, Features()))

    @ti.kernel
    def kernel(x: T.array, y: T.array, s: T.scalars(1)):  # type: ignore[name-defined,valid-type]
        for q in range(T.grain):
            if q == 0:
                if ti.static(constants):
                    ti.static(T.constants())
                v = x[0]
                y[0] = v * T.f(0.1) + T.vec(1.0)
                y[1] = T.vec(s[0]) - v * s[1]
                y[2] = ti.select(v > T.f(2.5), T.vec(-1.0), T.vec(3.0))
                y[3] = ti.max(v, T.f(2.0)) / T.f(3.0)
                chosen = ti.select(v >= s[0], T.flags(1), T.flags(0))
                union, _ = ti.static((T.union(chosen), 0))
                y[4] = ti.select((v > T.f(1.0)) & (v < T.f(4.0)), v, T.vec(ti.cast(union, T.f)))

    return Kernel(kernel)


def test_scalars_beside_vectors_are_those_that_stand_there():
    x = torch.tensor([[1.0, 2.0, 3.0, 4.0]])
    s = torch.tensor([3.5, 0.3])
    tenth, third = torch.tensor(0.1), torch.tensor(3.0)
    expected = torch.stack(
        [
            x[0] * tenth + 1,
            s[0] - x[0] * s[1],
            torch.tensor([3.0, 3.0, -1.0, -1.0]),
            torch.tensor([2.0, 2.0, 3.0, 4.0]) / third,
            torch.tensor([1.0, 2.0, 3.0, 1.0]),
        ]
    )
    for constants in (False, True):
        y = torch.zeros(5, LANES)
        kernel_of_constants(constants)(x, y, s)
        assert torch.equal(y, expected)


def test_taichi_reads_the_kernels_of_others_as_ever():
    ops = reading._module("ops")
    before = dict(vars(ops)), reading._module("matrix").VectorType.__call__
    with reading.lean():
        assert ops._binary_operation is not before[0]["_binary_operation"]
    with pytest.raises(KeyError), reading.lean():
        raise KeyError
    assert (dict(vars(ops)), reading._module("matrix").VectorType.__call__) == before
