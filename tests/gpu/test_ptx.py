"""The translation of PTX, instruction by instruction."""

from __future__ import annotations

import ctypes
import math
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import torch

from tests.gpu import ptx

_REGISTERS = {"f32": "%f", "f64": "%fd", "u32": "%r", "s32": "%r", "u64": "%rd", "s64": "%rd"}
_FORMATS = {"f32": "f", "f64": "d", "u32": "I", "s32": "i", "u64": "Q", "s64": "q"}

NAN = math.nan
CLOSE = 1 + 2**-12  # its square is 1 + 2**-11 + 2**-24, which has no place in float32
TINY = 2.0**-140  # a denormal of float32


def run(kernel: Any, memory: ctypes.Array, grid: int = 1, block: int = 1) -> None:
    """Launches a kernel with one parameter, the address of a memory."""
    address = ctypes.c_void_p(ctypes.addressof(memory))
    kernel(grid, block, ctypes.byref(ctypes.c_void_p(ctypes.addressof(address))))


def module(body: str) -> str:
    """A kernel with its one parameter in %rd9."""
    declared = "\n".join(
        f"\t.reg .{kind} {name}<10>;"
        for kind, name in (("pred", "%p"), ("b16", "%rs"), ("b32", "%r"), ("b64", "%rd"))
    )
    return (
        f".visible .entry kernel(\n\t.param .u64 kernel_param_0\n)\n{{\n{declared}\n"
        "\t.reg .f32 %f<10>;\n\t.reg .f64 %fd<10>;\n\tld.param.u64 %rd9, [kernel_param_0];\n"
        f"{body}\n\tret;\n}}\n"
    )


@pytest.fixture(autouse=True)
def _denormals() -> Iterator[None]:
    """Taichi makes its process flush them, Python's conversions included."""
    flushed = (2 * torch.tensor([TINY])).item() == 0
    torch.set_flush_denormal(False)
    yield
    torch.set_flush_denormal(flushed)


def computed(folder: Path, code: str, kind: str, values: tuple, result: str) -> float:
    """What a line computes of ``a``, ``b``, ``c``, registers of a kind, and leaves in ``x``."""
    names = {letter: f"{_REGISTERS[kind]}{place + 1}" for place, letter in enumerate("abc")}
    code = code.format(**names, x=f"{_REGISTERS[result]}8")
    loads = [
        f"ld.{kind} {names[letter]}, [%rd9+{8 * place}];"
        for place, letter in zip(range(len(values)), "abc", strict=False)
    ]
    store = f"st.{result} [%rd9], {_REGISTERS[result]}8;"
    kernel = ptx.load(module("\n".join([*loads, code, store])), "kernel", folder)
    packed = b"".join(struct.pack(f"<{_FORMATS[kind]}", each).ljust(8, b"\0") for each in values)
    memory = ctypes.create_string_buffer(packed)
    run(kernel, memory)
    return struct.unpack_from(f"<{_FORMATS[result]}", memory)[0]


@pytest.mark.parametrize(
    ("code", "kind", "values", "expected"),
    [
        ("fma.rn.f32 {x}, {a}, {b}, {c};", "f32", (CLOSE, CLOSE, -1 - 2**-11), 2**-24),
        ("mul.f32 {b}, {a}, {a}; add.f32 {x}, {b}, {c};", "f32", (CLOSE, 0, -1 - 2**-11), 0),
        ("fma.rn.f64 {x}, {a}, {b}, {c};", "f64", (2, 3, 5), 11),
        ("sub.f32 {x}, {a}, {b};", "f32", (2, 3), -1),
        ("div.rn.f64 {x}, {a}, {b};", "f64", (1, 3), 1 / 3),
        ("max.f32 {x}, {a}, {b};", "f32", (NAN, -1), -1),
        ("max.f32 {x}, {a}, {b};", "f32", (-1, NAN), -1),
        ("max.NaN.f32 {x}, {a}, {b};", "f32", (-1, NAN), NAN),
        ("max.NaN.f32 {x}, {a}, {b};", "f32", (NAN, -1), NAN),
        ("min.f64 {x}, {a}, {b};", "f64", (2, 1), 1),
        ("max.s32 {x}, {a}, {b};", "s32", (-2, 1), 1),
        ("mul.f32 {x}, {a}, {b};", "f32", (TINY, 2), 2 * TINY),
        ("mul.ftz.f32 {x}, {a}, {b};", "f32", (TINY, 2), 0),
        ("rsqrt.approx.f64 {x}, {a};", "f64", (16,), 0.25),
        ("shl.b32 {x}, {a}, {b};", "u32", (3, 31), 2**31),
        ("shl.b32 {x}, {a}, {b};", "u32", (3, 32), 0),
        ("shr.u32 {x}, {a}, {b};", "u32", (2**31, 31), 1),
        ("shr.u32 {x}, {a}, {b};", "u32", (2**31, 33), 0),
        ("shr.s32 {x}, {a}, {b};", "s32", (-8, 1), -4),
        ("shr.s32 {x}, {a}, {b};", "s32", (-8, 40), -1),
        ("shl.b64 {x}, {a}, 40;", "u64", (3,), 3 * 2**40),
        ("bfe.u32 {x}, {a}, 4, 8;", "u32", (0xABCDE,), 0xCD),
        ("mad.lo.s32 {x}, {a}, {b}, {c};", "s32", (2**30, 4, -7), -7),
        ("mul.hi.s32 {x}, {a}, {b};", "s32", (-(2**31), 3), -2),
        ("div.s32 {x}, {a}, {b};", "s32", (-7, 2), -3),
        ("rem.u32 {x}, {a}, {b};", "u32", (2**32 - 1, 10), 5),
        ("not.b32 {x}, {a};", "u32", (5,), 2**32 - 6),
    ],
)  # fmt: skip
def test_what_an_instruction_computes(folder, code, kind, values, expected) -> None:
    assert computed(folder, code, kind, values, kind) == pytest.approx(expected, 0, 0, nan_ok=True)


@pytest.mark.parametrize(
    ("code", "kind", "value", "to", "expected"),
    [
        ("cvt.rzi.s32.f32 {x}, {a};", "f32", -2.7, "s32", -2),
        ("cvt.rzi.s32.f32 {x}, {a};", "f32", NAN, "s32", 0),
        ("cvt.rzi.s32.f32 {x}, {a};", "f32", 3e9, "s32", 2**31 - 1),
        ("cvt.rzi.u32.f64 {x}, {a};", "f64", -1.0, "u32", 0),
        ("cvt.rzi.u32.f64 {x}, {a};", "f64", 3e9, "u32", 3 * 10**9),
        ("cvt.rn.f32.s32 {x}, {a};", "s32", -3, "f32", -3),
        ("cvt.rn.f32.u32 {x}, {a};", "u32", 2**32 - 1, "f32", 2**32),
        ("cvt.s64.s32 {x}, {a};", "s32", -5, "s64", -5),
        ("cvt.u64.u32 {x}, {a};", "u32", 2**32 - 5, "s64", 2**32 - 5),
        ("mul.wide.s32 {x}, {a}, {b};", "s32", -(2**31), "s64", 2**62),
        ("mov.b32 {x}, {a};", "f32", 1.0, "u32", 0x3F800000),
        ("mov.b32 %r2, 1072693248; mov.b64 {x}, {{{a}, %r2}};", "u32", 0, "f64", 1.0),
        ("mov.b64 {{%r2, {x}}}, {a};", "f64", 1.0, "u32", 0x3FF00000),
    ],
)
def test_what_becomes_of_other_types(folder, code, kind, value, to, expected) -> None:
    assert computed(folder, code, kind, (value, value), to) == expected


@pytest.mark.parametrize(
    ("comparison", "of_numbers", "of_nan"),
    [("lt", 1, 0), ("ltu", 1, 1), ("ge", 0, 0), ("geu", 0, 1), ("eq", 0, 0), ("ne", 1, 0),
     ("neu", 1, 1), ("gtu", 0, 1), ("leu", 1, 1)],
)  # fmt: skip
def test_comparisons_with_what_is_no_number(folder, comparison, of_numbers, of_nan) -> None:
    code = f"setp.{comparison}.f32 %p1, {{a}}, {{b}}; @!%p1 mov.f32 {{x}}, 0f00000000;"
    code += " @%p1 mov.f32 {x}, 0f3F800000;"
    assert computed(folder, code, "f32", (1, 2), "f32") == of_numbers
    assert computed(folder, code, "f32", (1, NAN), "f32") == of_nan


@pytest.mark.parametrize(("value", "expected"), [(1, 20), (2, 30)])
def test_selection(folder: Path, value: int, expected: int) -> None:
    code = "setp.eq.s32 %p1, {a}, 1; selp.s32 {x}, 20, 30, %p1;"
    assert computed(folder, code, "s32", (value,), "s32") == expected


def test_an_approximate_reciprocal_in_float64_has_half_the_digits(folder: Path) -> None:
    third = computed(folder, "rcp.approx.ftz.f64 {x}, {a};", "f64", (3.0,), "f64")
    assert 1e-9 < abs(third - 1 / 3) < 1e-6


CALLED = """
.func twice(
	.param .b64 twice_param_0,
	.param .b32 twice_param_1
)
{
	.reg .b32 %r<3>;
	.reg .b64 %rd<2>;
	ld.param.u64 %rd1, [twice_param_0];
	ld.param.u32 %r1, [twice_param_1];
	add.s32 %r2, %r1, %r1;
	st.u32 [%rd1], %r2;
	ret;
}
"""
LOOP = """
	mov.u32 %r1, %ctaid.x;
	mov.u32 %r2, %ntid.x;
	mov.u32 %r3, %tid.x;
	mad.lo.s32 %r4, %r1, %r2, %r3;
	mul.wide.u32 %rd1, %r4, 4;
	add.s64 %rd2, %rd9, %rd1;
	mov.u32 %r5, 0;
	mov.u32 %r6, 0;
$L__BB0_1: // the sum of the numbers up to that of the thread
	add.s32 %r5, %r5, %r6;
	add.s32 %r6, %r6, 1;
	setp.le.u32 %p1, %r6, %r4;
	@%p1 bra $L__BB0_1;
	{ // callseq 1, 0
	.reg .b32 temp_param_reg;
	.param .b64 param0;
	st.param.b64 [param0+0], %rd2;
	.param .b32 param1;
	st.param.b32 [param1+0], %r5;
	call.uni
	twice,
	(
	param0,
	param1
	);
	} // callseq 1
	atom.global.add.u32 %r7, [%rd9+48], 1;
"""


def test_every_thread_runs_once(folder: Path) -> None:
    """Twice the sum of 0 to i is i (i + 1); behind these twelve numbers threads are counted."""
    memory = (ctypes.c_uint32 * 13)()
    run(ptx.load(CALLED + module(LOOP), "kernel", folder), memory, grid=3, block=4)
    assert list(memory) == [*(i * (i + 1) for i in range(12)), 12]


@pytest.mark.parametrize(
    "line",
    [
        "sin.approx.f32 %f1, %f2",
        "bar.sync 0",
        "mov.u32 %r1, %laneid",
        "cvt.rni.s32.f32 %r1, %f1",
        "setp.lt.and.f32 %p1, %f1, %f2, %p2",
        "add.s32 %r1, %f1, %r2",
        "add.f32 %f1, %f2, 1",
        "ld.f32 %r1, [%rd1]",
        "red.global.add.u32 [%rd1], 1",
        ".shared .align 4 .b8 memory[16]",
    ],
)
def test_what_is_unknown_raises(line: str) -> None:
    with pytest.raises(ValueError, match="cannot translate") as caught:
        ptx.translate(module(f"\t{line};"), "kernel")
    assert repr(line) in str(caught.value)
