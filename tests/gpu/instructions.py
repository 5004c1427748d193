"""What the instructions of PTX compute, as expressions in C.

These are the instructions that LLVM gives Taichi's kernels; others are unknown. "Approximate"
divisions and roots are rounded correctly here, but for the reciprocal in float64, which has half
its digits, as on a GPU.
"""

from __future__ import annotations

TYPES = {
    "pred": "uint8_t",
    "b8": "uint8_t",
    "u8": "uint8_t",
    "b16": "uint16_t",
    "u16": "uint16_t",
    "s16": "int16_t",
    "b32": "uint32_t",
    "u32": "uint32_t",
    "s32": "int32_t",
    "b64": "uint64_t",
    "u64": "uint64_t",
    "s64": "int64_t",
    "f32": "float",
    "f64": "double",
}

# Of two numbers max and min give the one that is a number; -0 is less than 0.
_MAX = "{0} > {1} || ({0} == {1} && __builtin_signbit({1})) ? {0} : {1}"
_MIN = "{0} < {1} || ({0} == {1} && __builtin_signbit({0})) ? {0} : {1}"

# The operands are {0}, {1}, {2}. A name without a type holds for all types that have no name of
# their own; `_FORMS` are left out of names. A comparison in C is false if an operand is not a
# number; one of PTX with a "u" is true then.
_EXPRESSIONS = {
    "abs.f32": "__builtin_fabsf({0})",
    "abs.f64": "__builtin_fabs({0})",
    "add": "{0} + {1}",
    "and": "{0} & {1}",
    "bfe.u32": "{0} >> {1} & (uint32_t)((1ull << {2}) - 1)",
    "cvta": "{0}",
    "div": "{0} / {1}",
    "fma.f32": "__builtin_fmaf({0}, {1}, {2})",
    "fma.f64": "__builtin_fma({0}, {1}, {2})",
    "mad.lo": "{0} * {1} + {2}",
    "max": "{0} > {1} ? {0} : {1}",
    "max.f32": f"{{1}} != {{1}} || {_MAX}",
    "max.f64": f"{{1}} != {{1}} || {_MAX}",
    "max.NaN.f32": f"{{0}} != {{0}} || {_MAX}",
    "min": "{0} < {1} ? {0} : {1}",
    "min.f32": f"{{1}} != {{1}} || {_MIN}",
    "min.f64": f"{{1}} != {{1}} || {_MIN}",
    "mul.f32": "{0} * {1}",
    "mul.f64": "{0} * {1}",
    "mul.hi.s32": "(int64_t){0} * {1} >> 32",
    "mul.lo": "{0} * {1}",
    "mul.wide.s32": "(int64_t){0} * {1}",
    "mul.wide.u16": "(uint32_t){0} * {1}",
    "mul.wide.u32": "(uint64_t){0} * {1}",
    "neg": "-{0}",
    "not": "~{0}",
    "not.pred": "!{0}",
    "or": "{0} | {1}",
    "popc.b32": "__builtin_popcount({0})",
    "rcp": "1 / {0}",
    "rcp.approx.ftz.f64": "half_the_digits(1 / {0})",
    "rem": "{0} % {1}",
    "rsqrt": "1 / __builtin_sqrt({0})",
    "selp": "{2} ? {0} : {1}",
    "setp.eq": "{0} == {1}",
    "setp.ge": "{0} >= {1}",
    "setp.geu": "!({0} < {1})",
    "setp.gt": "{0} > {1}",
    "setp.gtu": "!({0} <= {1})",
    "setp.le": "{0} <= {1}",
    "setp.leu": "!({0} > {1})",
    "setp.lt": "{0} < {1}",
    "setp.ltu": "!({0} >= {1})",
    "setp.ne": "{0} != {1}",
    "setp.ne.f32": "{0} < {1} || {0} > {1}",
    "setp.ne.f64": "{0} < {1} || {0} > {1}",
    "setp.neu": "{0} != {1}",
    "shl": "{1} < 8 * sizeof {0} ? {0} << {1} : 0",
    "shr": "{1} < 8 * sizeof {0} ? {0} >> {1} : 0",
    "shr.s32": "{0} >> ({1} < 32 ? {1} : 31)",
    "shr.s64": "{0} >> ({1} < 64 ? {1} : 63)",
    "sqrt": "__builtin_sqrt({0})",
    "sub": "{0} - {1}",
    "xor": "{0} ^ {1}",
}
_FORMS = {"rn", "ftz", "approx", "global", "local", "to"}
# Operands, by instruction and place, whose type is not that of the instruction's name.
_OPERANDS = {("selp", 2): "pred", ("shl", 1): "u32", ("shr", 1): "u32"}
# From floats to integers: towards zero, and to the nearest there is beyond the ends.
_ENDS = {"s32": "INT32_MIN, INT32_MAX", "u32": "0, UINT32_MAX"}

# What an atomic instruction stores instead of the old value; threads run in turn.
ATOMS = {"add": "old + {}", "exch": "{}"}

# C that the expressions need.
HELPERS = """
static double float64(uint64_t bits) { double x; memcpy(&x, &bits, 8); return x; }
static float float32(uint32_t bits) { float x; memcpy(&x, &bits, 4); return x; }
static double half_the_digits(double x) {
  uint64_t bits;
  memcpy(&bits, &x, 8);
  return float64(bits >> 32 << 32);
}
static int64_t truncated(double x, double least, double most) {
  return x != x ? 0 : x < least ? least : x > most ? most : x;
}
"""


def is_float(kind: str) -> bool:
    """Whether a type of PTX is one of floating-point numbers."""
    return kind.startswith("f")


def expression(opcode: str, operands: int) -> tuple[str, list[str]]:
    """What an instruction computes.

    Args:
        opcode: its full name, as "fma.rn.ftz.f32".
        operands: number of its sources.

    Returns:
        The expression, and the types of the operands that go into its {0}, {1}, {2}.

    Raises:
        KeyError: it is unknown.
    """
    base, *middle, kind = opcode.split(".")
    if base == "cvt":
        return _conversion(set(middle[:-1]), middle[-1], kind), [kind]
    name = ".".join([base, *(each for each in middle if each not in _FORMS)])
    for each in (opcode, f"{name}.{kind}", name):
        if each in _EXPRESSIONS:
            kinds = [_OPERANDS.get((base, place), kind) for place in range(operands)]
            return _EXPRESSIONS[each], kinds
    raise KeyError(opcode)


def _conversion(forms: set[str], to: str, source: str) -> str:
    forms = forms - _FORMS
    if forms == {"rzi"} and is_float(source):
        return f"({TYPES[to]})truncated({{0}}, {_ENDS[to]})"
    if forms or (is_float(source) and not is_float(to)):
        raise KeyError(f"a conversion from {source} to {to} with {forms}")
    return f"({TYPES[to]}){{0}}"
