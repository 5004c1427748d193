"""PTX to C: the kernels of a GPU, run on the CPU one thread after the other.

Where that is not what a GPU does:

- threads that wait for each other cannot be run in turn: barriers and shared memory are unknown;
- a kernel that flushes denormals in one instruction flushes them in all;
- a thread that is told to stop, as by a failed assertion, ends the process, and so does a call
  through a pointer, with which Taichi would call the host.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

from tests.gpu.function import Function, c_name
from tests.gpu.instructions import HELPERS

COMPILER = shutil.which("cc") or shutil.which("gcc")
# Only what PTX fuses is fused; integers wrap around; memory has no types.
_FLAGS = "-O1 -w -march=native -ffp-contract=off -fwrapv -fno-strict-aliasing -shared -fPIC -lm"
_FLUSH = 0x8040  # of the processor's control register: denormals that go in or come out

_FUNCTION = re.compile(r"(\.entry|\.func)\s+([\w$]+)\s*\(([^)]*)\)[^{;]*{(.*?)^}", re.S | re.M)
_CONSTANT = re.compile(r"\.global \.align \d+ \.b8 ([\w$]+)\[\d+\] = ({.*?});")
_BEGIN = f"""
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <xmmintrin.h>
{HELPERS}
static uint32_t tid, ntid, ctaid, nctaid;
static void call___assertfail(uint64_t text, ...) {{
  fputs((char *)text, stderr);
  abort();
}}
"""
_END = """
void run(uint32_t grid, uint32_t block, void **arguments) {{
  unsigned mode = _mm_getcsr();
  _mm_setcsr((mode & ~{mask}u) | {flush});
  ntid = block, nctaid = grid;
  for (ctaid = 0; ctaid < grid; ctaid++)
    for (tid = 0; tid < block; tid++) call_{entry}(arguments);
  _mm_setcsr(mode);
}}
"""


def load(ptx: str, entry: str, folder: Path) -> Any:
    """A kernel as a C function ``(grid, block, arguments)``, a launch of so many threads.

    Args:
        ptx: the module's text.
        entry: the kernel's name.
        folder: where compiled kernels are kept; what lies there is not compiled again.
    """
    source = translate(ptx, entry)
    file = folder / f"{hashlib.sha256(source.encode()).hexdigest()[:20]}.so"
    if not file.exists():
        assert COMPILER
        unfinished = f"{file}.{os.getpid()}"
        command = [COMPILER, "-x", "c", "-", "-o", unfinished, *_FLAGS.split()]
        subprocess.run(command, input=source, text=True, check=True)
        os.replace(unfinished, file)
    run = ctypes.CDLL(str(file)).run
    run.argtypes, run.restype = [ctypes.c_uint32, ctypes.c_uint32, ctypes.c_void_p], None
    return run


def translate(ptx: str, entry: str) -> str:
    """A kernel and all that it calls, as a C program.

    Args:
        ptx: the module's text.
        entry: the kernel's name.

    Raises:
        ValueError: an instruction or a function is unknown; the message shows it.
    """
    ptx = re.sub(r"//.*", "", ptx)
    known = {match[2]: Function(*match.groups()) for match in _FUNCTION.finditer(ptx)}
    needed: dict[str, Function] = {}
    wanted = [entry]
    while wanted:
        name = wanted.pop()
        if name in needed or name == "__assertfail":
            continue
        if name not in known:
            raise ValueError(f"PTX: expected the function {name} in this form, got none")
        needed[name] = known[name]
        wanted += known[name].translate()
    constants = [
        f"static uint8_t {c_name(name)}[] = {data};" for name, data in _CONSTANT.findall(ptx)
    ]
    heads = [f"{function.head};" for function in needed.values()]
    bodies = [function.text for function in needed.values()]
    flush = _FLUSH if any("ftz" in function.body for function in needed.values()) else 0
    end = _END.format(mask=_FLUSH, flush=flush, entry=c_name(entry))
    return "\n".join([_BEGIN, *constants, *heads, *bodies, end])
