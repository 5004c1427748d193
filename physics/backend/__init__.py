"""The language of the kernels: start-up, number types, loops over groups, launches.

Taichi 1.7.4 is the last release of its line, so the rest of the package uses a small subset
of the language through the names exported here, and the backend stays replaceable; `language` is
the only module that imports it.

Worlds are simulated in groups: every quantity of a group is one vector with a lane per world.
On a CPU kernels are strict IEEE (``fast_math=False``): a world's result depends neither on its lane
nor on its neighbours.

With one lane per group a kernel is the scalar program, a world per thread, and the tensors lie the
other way round: an item of all worlds side by side. That is how a GPU runs; the CPU can run it too,
which is how it is checked. For a GPU Taichi always contracts to fused multiply-adds, flushes
denormals and divides approximately in float32: results are those of the CPU to rounding only.

``real_matrix_scalarize=False``, on the CPU, keeps these vectors whole down to LLVM's own vector
types. Measured against the default, which takes them apart and leaves it to LLVM to find them
again: 2.3 times the speed, a quarter of the compile time. In this mode Taichi 1.7.4 knows only part
of its operations on vectors; the others abort the process in LLVM. Use on lane vectors ``+ - * /``,
comparisons, ``& | ~`` of masks, ``select``, ``max``, ``min``, ``sqrt``. Write ``0 - x`` for ``-x``,
``x = x - y`` for ``x -= y``, ``lane_math.magnitude`` for ``abs``, ``lane_math.any_lane`` for
``any`` (which sees lane 0 alone, silently, as ``mask[lane]`` sees nothing); do casts, bits and
libm functions lane by lane (``S[item][lane]``).
"""

from physics.backend.groups import Block, Group
from physics.backend.kernel import Kernel
from physics.backend.language import BACKENDS, NAME, ti
from physics.backend.numbers import GRAIN, Real, integers, real
from physics.backend.process import start
from physics.backend.program import Features, Program, packed, unpacked

__all__ = [
    "BACKENDS",
    "GRAIN",
    "NAME",
    "Block",
    "Features",
    "Group",
    "Kernel",
    "Program",
    "Real",
    "integers",
    "packed",
    "real",
    "start",
    "ti",
    "unpacked",
]
