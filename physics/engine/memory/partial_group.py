"""How a program of few lanes works on a group with room for more.

The last group of a batch may be half empty. A program of half as many lanes then takes three
quarters of the time, if what it works on lies together as in a group of its own: spread over the
group's cache lines it would take nearly as long as one of the full width. So it moves the lanes
together, in place, does its steps, and moves them apart again.
"""

from physics.backend import ti
from physics.engine.memory import layout as lay


@ti.func
def squeeze(A: ti.template(), T: ti.template()):
    """Moves the first lanes of all items of a group together.

    The array is seen as vectors of the program's lanes, several to an item.
    """
    parts = ti.static(T.places // T.lanes)
    for item in range(1, A.items):
        A[item] = A[item * parts]


@ti.func
def spread(A: ti.template(), T: ti.template()):
    """Moves them apart again. The empty places, which lent their room, get the same values."""
    parts = ti.static(T.places // T.lanes)
    for k in range(A.items):
        item = A.items - 1 - k
        values = A[item]
        for part in ti.static(range(parts)):
            A[item * parts + part] = values


@ti.func
def end_copies(S: ti.template(), m: ti.template(), T: ti.template()):
    """The empty places of a state hold worlds that are over."""
    parts = ti.static(T.places // T.lanes)
    for part in ti.static(range(1, parts)):
        for item in ti.static((lay.H_LIFE, lay.H_LIFE_HIGH)):
            S[(m.header + item) * parts + part] = T.vec(0.0)
