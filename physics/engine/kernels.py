"""The kernels: loops over groups of worlds and over steps.

A kernel takes few, packed tensors because each costs some 8 microseconds per launch, and runs
all its steps for one group before it turns to the next: the group's state stays in the cache.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Any

from physics import backend
from physics.backend import Kernel, Program, ti
from physics.engine import actuation, step
from physics.engine.memory import layout as lay
from physics.engine.memory import partial_group
from physics.engine.memory.model import load_sizes, sizes_of_group
from physics.engine.sensing import sense


@ti.func
def _publish(S: ti.template(), m: ti.template(), readings: ti.template(), T: ti.template()):
    """Copies the readings of a group to the caller's (N, R) tensor."""
    for lane in range(T.lanes):
        world = S.number * T.places + lane
        if world < readings.shape[0]:
            for r in range(m.readings):
                readings[world, r] = S[m.reading_block + r][lane]


@ti.func
def _take_commands(
    S: ti.template(), m: ti.template(), actions: ti.template(), row, T: ti.template()
):
    """Copies a row of the caller's (control steps, N, V) actuations to a group."""
    for v in range(m.voxels):
        asked = S.at[v * lay.VOXEL_ITEMS + lay.COMMAND]
        for lane in range(T.lanes):
            world = S.number * T.places + lane
            if world < actions.shape[1]:
                asked[0][lane] = actions[row, world, v]
        actuation.receive(S, m, v, asked[0], T)


@ti.func
def _share(chunk, first, count, chunks):
    """The groups of a chunk, as a range; of `count` groups, some chunks get one more."""
    size, more = count // chunks, count % chunks
    begin = first + chunk * size + ti.min(chunk, more)
    return begin, begin + size + (1 if chunk < more else 0)


@lru_cache
def play(program: Program) -> Kernel:
    """The kernel for given actuations: ``(S, lists, terrain, mi, mf, actions, readings, begin,
    end, first, count, chunks)``.

    It takes the engine steps from ``begin`` to before ``end`` in groups ``first`` to before
    ``first + count``, the actuations of each control step from a row of its own. A step -1
    moves nothing: it finds contacts and readings of the present poses. That this is no kernel of
    its own spares a quarter of what is compiled before the first step.
    """
    backend.start(program.device)
    T = backend.real(program)

    @ti.kernel
    def play(
        S: T.array,  # type: ignore[name-defined]
        lists: backend.integers(2),  # type: ignore[valid-type]
        terrain: T.scalars(3),  # type: ignore[valid-type]
        mi: backend.integers(1),  # type: ignore[valid-type]
        mf: T.scalars(1),  # type: ignore[valid-type]
        actions: T.scalars(3),  # type: ignore[valid-type]
        readings: T.scalars(2),  # type: ignore[valid-type]
        begin: ti.i32,
        end: ti.i32,
        first: ti.i32,
        count: ti.i32,
        chunks: ti.i32,
    ):
        for q in range(chunks * T.grain):
            if q % T.grain == 0:
                m = load_sizes(mi, 0)
                begin_group, end_group = _share(q // T.grain, first, count, chunks)
                for g in range(begin_group, end_group):
                    sizes_of_group(m, mi, g)
                    state, contacts = ti.static((T.group(S, g, m.group_items), T.lists(lists, g)))
                    if ti.static(T.narrow):
                        partial_group.squeeze(state, T)
                    for t in range(begin, end):
                        if t >= 0:
                            if t % m.control_interval == 0:
                                _take_commands(state, m, actions, t // m.control_interval, T)
                            actuation.actuate(state, m, mf, T)
                            step.advance(state, contacts, m, mi, mf, T)
                        step.touch(state, contacts, terrain, m, mi, mf, t >= 0, T)
                        sense(state, m, mi, mf, T)
                    _publish(state, m, readings, T)
                    if ti.static(T.narrow):
                        partial_group.spread(state, T)
                        partial_group.end_copies(state, m, T)

    return backend.Kernel(play)


def closed_loop(program: Program, controller: Callable[..., Any]) -> Kernel:
    """A kernel that runs many control steps with the controller inside.

    Args:
        program: what it is compiled for.
        controller: a Taichi function ``(S, net, m, T)`` that reads the readings from
            ``S[m.reading_block + r]`` and calls ``actuation.receive`` for every voxel;
            ``net`` is a tensor (groups, items, lanes) of its own.

    Returns:
        ``kernel(S, lists, terrain, mi, mf, net, steps, first, count, chunks)``, which takes so
        many control steps; the groups and chunks as in `play`.
    """
    backend.start(program.device)
    T = backend.real(program)

    @ti.kernel
    def live(
        S: T.array,  # type: ignore[name-defined]
        lists: backend.integers(2),  # type: ignore[valid-type]
        terrain: T.scalars(3),  # type: ignore[valid-type]
        mi: backend.integers(1),  # type: ignore[valid-type]
        mf: T.scalars(1),  # type: ignore[valid-type]
        net: T.array,  # type: ignore[name-defined]
        steps: ti.i32,
        first: ti.i32,
        count: ti.i32,
        chunks: ti.i32,
    ):
        for q in range(chunks * T.grain):
            if q % T.grain == 0:
                m = load_sizes(mi, 0)
                begin_group, end_group = _share(q // T.grain, first, count, chunks)
                for g in range(begin_group, end_group):
                    sizes_of_group(m, mi, g)
                    state, contacts, network = ti.static(
                        (
                            T.group(S, g, m.group_items),
                            T.lists(lists, g),
                            T.group(net, g, T.items(net, S, m.group_items)),
                        )
                    )
                    if ti.static(T.narrow):
                        partial_group.squeeze(state, T)
                        partial_group.squeeze(network, T)
                    for _ in range(steps):
                        for part in range(m.control_interval):
                            if part > 0:
                                actuation.actuate(state, m, mf, T)
                            step.advance(state, contacts, m, mi, mf, T)
                            step.touch(state, contacts, terrain, m, mi, mf, True, T)
                            sense(state, m, mi, mf, T)
                        controller(state, network, m, T)
                        actuation.actuate(state, m, mf, T)
                    if ti.static(T.narrow):
                        partial_group.spread(state, T)
                        partial_group.spread(network, T)
                        partial_group.end_copies(state, m, T)

    return backend.Kernel(live)
