"""A function of PTX, line by line in C."""

from __future__ import annotations

import re
from collections.abc import Iterator

from tests.gpu.instructions import ATOMS, TYPES, expression, is_float

_THREAD = {"%tid.x": "tid", "%ntid.x": "ntid", "%ctaid.x": "ctaid", "%nctaid.x": "nctaid"}
_PARAMETER = re.compile(r"\.param [^,]*?([\w$]+)(?:\[\d+\])?\s*(?:,|$)")


def c_name(symbol: str) -> str:
    """A symbol of PTX, as a name in C."""
    return re.sub(r"\W", "_", symbol.lstrip("%"))


def _parts(pattern: str, text: str) -> tuple[str, ...]:
    """The groups of a pattern.

    Raises:
        ValueError: the text does not match.
    """
    if found := re.fullmatch(pattern, text):
        return found.groups()
    raise ValueError(text)


class Function:
    """A function of PTX.

    In C its registers are variables, and its parameters bytes, as in PTX. A kernel gets pointers
    to them, another function 64 bits each.
    """

    def __init__(self, kind: str, name: str, parameters: str, body: str) -> None:
        self.body = body
        self._parameters = [c_name(each) for each in _PARAMETER.findall(parameters)]
        self._is_kernel = kind == ".entry"
        words = [f"uint64_t word{place}" for place in range(len(self._parameters))]
        declared = "void **arguments" if self._is_kernel else ", ".join(words)
        self.head = f"static void call_{c_name(name)}({declared})"
        self._registers: dict[str, str] = {}  # their types, by name without number
        self._variables: dict[str, None] = {}  # declarations in C, each once
        self._called: list[str] = []

    def translate(self) -> list[str]:
        """Makes the text; returns the names of the functions that it calls."""
        for place, name in enumerate(self._parameters):
            source = f"arguments[{place}]" if self._is_kernel else f"&word{place}"
            self._variables[f"char *{name} = (char *){source};"] = None
        # Blocks have names of their own, but none that means something else outside.
        flat = re.sub(r"^\s*[{}]\s*$", "", self.body, flags=re.M)
        flat = re.sub(r"^([\w$]+):", r"\1:;", flat, flags=re.M)
        lines = [self._line(" ".join(line.split())) for line in flat.split(";")]
        self.text = "\n".join([f"{self.head} {{", *self._variables, *lines, "}"])
        return self._called

    def _line(self, line: str) -> str:
        """One line in C.

        Raises:
            ValueError: it is unknown.
        """
        if not line or line.startswith(".pragma") or ".callprototype" in line:
            return ""
        if line.endswith(":"):
            return f"{c_name(line[:-1])}:;"
        try:
            if line.startswith("."):
                return self._declare(line)
            guard, opcode, rest = _parts(r"(?:@(!?%\w+) )?(\S+) ?(.*)", line)
            code = self._instruction(opcode, rest)
        except (KeyError, TypeError, ValueError) as error:
            raise ValueError(f"PTX: cannot translate {line!r}") from error
        condition = f"if ({guard.replace('%', '')}) " if guard else ""
        return f"{condition}{{ {code} }}"

    def _declare(self, line: str) -> str:
        if found := re.fullmatch(r"\.reg \.(\w+) %?([A-Za-z_]+)(?:<(\d+)>)?", line):
            kind, name, count = found.groups()
            self._registers[name] = kind
            names = [f"{name}{number}" for number in range(int(count))] if count else [name]
            self._variables[f"{TYPES[kind]} {', '.join(names)};"] = None
        elif found := re.fullmatch(r"\.local \.align \d+ \.b8 ([\w$]+)\[(\d+)\]", line):
            memory = f"char {c_name(found[1])}[{found[2]}] __attribute__((aligned(16)));"
            self._variables[memory] = None
        elif found := re.fullmatch(r"\.param \.\w+ (\w+)", line):  # of a call
            self._variables[f"uint64_t {found[1]}[1];"] = None
        else:
            raise ValueError("an unknown declaration")
        return ""

    def _instruction(self, opcode: str, rest: str) -> str:
        base, kind = opcode.split(".")[0], opcode.split(".")[-1]
        if base == "call":
            return self._call(rest)
        operands = re.findall(r"{.*?}|\[.*?\]|[^,\s]+", rest)
        match base:
            case "bra":
                return f"goto {c_name(operands[0])};"
            case "ret":
                return "return;"
            case "exit":
                return "abort();"
            case "membar":
                return ""
            case "mov":
                return self._move(*operands)
            case "ld":
                cells = self._cells(operands[1], operands[0], kind)
                return " ".join(f"{name} = {cell};" for cell, name, _ in cells)
            case "st":
                cells = self._cells(operands[0], operands[1], kind)
                return " ".join(f"{cell} = {value};" for cell, _, value in cells)
            case "atom":
                return self._atom(opcode.split(".")[-2], kind, *operands)
        return self._compute(opcode, *operands)

    def _compute(self, opcode: str, target: str, *sources: str) -> str:
        template, kinds = expression(opcode, len(sources))
        values = [self._value(*each) for each in zip(sources, kinds, strict=True)]
        return f"{c_name(target)} = {template.format(*values)};"

    def _value(self, operand: str, kind: str) -> str:
        """An operand as a number of a type."""
        if operand in _THREAD:
            text, has = _THREAD[operand], "u32"
        elif operand.startswith("%"):
            text, has = c_name(operand), self._kind(operand)
        elif found := re.fullmatch(r"0([fd])([0-9A-Fa-f]+)", operand):
            has = {"f": "f32", "d": "f64"}[found[1]]
            text = f"float{has[1:]}(0x{found[2]})"
        elif re.fullmatch(r"-?\d+", operand):
            text, has = f"{operand}ll", "s64"
        else:  # an array's address
            text, has = c_name(operand), "u64"
        if is_float(kind) != is_float(has):
            raise ValueError(f"{operand} as {kind}")
        return f"(({TYPES[kind]}){text})"

    def _kind(self, register: str) -> str:
        """A register's type."""
        return self._registers[re.sub(r"\d+$", "", register.lstrip("%"))]

    def _address(self, operand: str) -> str:
        base, offset = _parts(r"\[(%?[\w$]+)\+?(-?\d+)?\]", operand)
        return f"((char *){c_name(base)} + {offset or 0})"

    def _cells(self, address: str, operands: str, kind: str) -> Iterator[tuple[str, str, str]]:
        """Of one number in memory or several side by side: its place; its operand, as a variable
        and as a number of the type in memory."""
        for place, operand in enumerate(operands.strip("{}").split(",")):
            cell = f"(({TYPES[kind]} *){self._address(address)})[{place}]"
            yield cell, c_name(operand.strip()), self._value(operand.strip(), kind)

    def _move(self, target: str, source: str) -> str:
        """A copy, between registers of different types bit by bit."""
        if target.startswith("{"):
            low, high = (c_name(each.strip()) for each in target.strip("{}").split(","))
            whole = c_name(source)
            return f"memcpy(&{low}, &{whole}, 4); memcpy(&{high}, (char *)&{whole} + 4, 4);"
        whole, kind = c_name(target), self._kind(target)
        if source.startswith("{"):
            low, high = (c_name(each.strip()) for each in source.strip("{}").split(","))
            return f"memcpy(&{whole}, &{low}, 4); memcpy((char *)&{whole} + 4, &{high}, 4);"
        is_register = source.startswith("%") and source not in _THREAD
        if is_register and self._kind(source) != kind:
            return f"memcpy(&{whole}, &{c_name(source)}, sizeof {whole});"
        return f"{whole} = {self._value(source, kind)};"

    def _atom(self, operation: str, kind: str, target: str, address: str, source: str) -> str:
        memory, new = f"*({TYPES[kind]} *){self._address(address)}", ATOMS[operation]
        store = f"{memory} = {new.format(self._value(source, kind))};"
        return f"{TYPES[kind]} old = {memory}; {store} {c_name(target)} = old;"

    def _call(self, rest: str) -> str:
        name, arguments = _parts(r"(?:\(\w+\), )?(\S+), \( (.*?) \).*", rest)
        if name.startswith("%"):
            return "abort();"
        self._called.append(name)
        words = (f"{c_name(each.strip())}[0]" for each in arguments.split(","))
        return f"call_{c_name(name)}({', '.join(words)});"
