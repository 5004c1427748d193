"""How one step is computed: the kernels and their stages.

What nearly every function of a kernel takes, by the letter that it has everywhere:

- ``S``: the state of a group of worlds, `backend.Group`. ``S[item]`` is one item, a vector with a
  lane per world; ``S.at[item]`` the items from there on, such as a body; ``S.lists`` its integers.
  Where what lies is said in `memory.layout`.
- ``m``: the model, `memory.tables.Tables`: sizes by name (``m.voxels``), and the tables
  ``m.integers`` and ``m.numbers``.
- ``T``: the number type, `backend.Real`: ``T.f(0.1)`` is a literal, ``T.vec(0.0)`` one per lane;
  a bare ``0.1`` is a double, and beside lanes of floats it can crash Taichi's compiler.
  ``T.features`` are the stages that the kernel has at all.

All three exist while Taichi compiles only, and cost nothing in the kernel.

The names below are what kernels outside of this package are made of.
"""

from physics.engine import step
from physics.engine.actuation import receive
from physics.engine.kernels import closed_loop
from physics.engine.lane_math import limited, magnitude, tanh
from physics.engine.memory import layout
from physics.engine.memory.tables import F_NOISE, Tables, load_sizes
from physics.engine.sensing import sense

__all__ = [
    "F_NOISE",
    "Tables",
    "closed_loop",
    "layout",
    "limited",
    "load_sizes",
    "magnitude",
    "receive",
    "sense",
    "step",
    "tanh",
]
