"""The kernels: loops over groups of worlds and over steps.

A kernel takes few, packed tensors because each costs some 8 microseconds per launch, and runs
all its steps for one group before it turns to the next: the group's state stays in the cache.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Any

from physics import backend
from physics.backend import Kernel, Program, Real, ti
from physics.engine import actuation, step
from physics.engine.memory import layout as lay
from physics.engine.memory import partial_group
from physics.engine.memory.tables import Tables, load_sizes, sizes_of_group
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
    """The kernel for given actuations, (control steps, N, V): those of each control step from a
    row of its own. It counts engine steps.

    A step -1 moves nothing: it finds contacts and readings of the present poses. That this is no
    kernel of its own spares a quarter of what is compiled before the first step.
    """
    T = _started(program)

    @ti.func
    def play(
        S: ti.template(),
        terrain: ti.template(),
        m: ti.template(),
        actions: ti.template(),
        begin,
        end,
    ):
        for t in range(begin, end):
            if t >= 0:
                if t % m.control_interval == 0:
                    _take_commands(S, m, actions, t // m.control_interval, T)
                actuation.actuate(S, m, T)
                step.advance(S, m, T)
            step.touch(S, terrain, m, t >= 0, T)
            sense(S, m, T)

    return _over_groups(T, T.scalars(3), play)


def closed_loop(program: Program, controller: Callable[..., Any]) -> Kernel:
    """A kernel with the controller inside. It counts control steps.

    Args:
        program: what it is compiled for.
        controller: a Taichi function ``(S, net, m, T)`` that reads the readings from
            ``S[m.reading_block + r]`` and calls ``actuation.receive`` for every voxel;
            ``net`` is the network's tensor (groups, items, lanes), what the kernel is given.
    """
    T = _started(program)

    @ti.func
    def live(
        S: ti.template(), terrain: ti.template(), m: ti.template(), net: ti.template(), begin, end
    ):
        network, _ = ti.static((T.group(net, S.number, T.items(net, S)), 0))
        if ti.static(T.narrow):
            partial_group.squeeze(network, T)
        for _t in range(begin, end):
            for part in range(m.control_interval):
                if part > 0:
                    actuation.actuate(S, m, T)
                step.advance(S, m, T)
                step.touch(S, terrain, m, True, T)
                sense(S, m, T)
            controller(S, network, m, T)
            actuation.actuate(S, m, T)
        if ti.static(T.narrow):
            partial_group.spread(network, T)

    return _over_groups(T, T.array, live)


def _started(program: Program) -> Real:
    """The number type of a program, once Taichi runs on its device."""
    backend.start(program.device)
    return backend.real(program)


def _over_groups(T: Real, kind: Any, work: Callable[..., Any]) -> Kernel:
    """A kernel ``(S, lists, terrain, mi, mf, given, readings, begin, end, first, count, chunks)``.

    In groups ``first`` to before ``first + count`` it does the work of steps ``begin`` to before
    ``end``; what the sensors read last goes into ``readings``, (N, R).

    Args:
        T: its number type.
        kind: Taichi's type of ``given``.
        work: a Taichi function ``(S, terrain, m, given, begin, end)`` for one group.
    """

    @ti.kernel
    def kernel(
        S: T.array,  # type: ignore[name-defined]
        lists: backend.integers(2),  # type: ignore[valid-type]
        terrain: T.scalars(3),  # type: ignore[valid-type]
        mi: backend.integers(1),  # type: ignore[valid-type]
        mf: T.scalars(1),  # type: ignore[valid-type]
        given: kind,  # type: ignore[valid-type]
        readings: T.scalars(2),  # type: ignore[valid-type]
        begin: ti.i32,
        end: ti.i32,
        first: ti.i32,
        count: ti.i32,
        chunks: ti.i32,
    ):
        if ti.static(T.on_gpu):  # on a CPU it would be another number: turns that a thread takes
            ti.loop_config(block_dim=T.block)
        for q in range(chunks * T.grain):
            if q % T.grain == 0:
                ti.static(T.constants())
                sizes = load_sizes(mi, 0)
                begin_group, end_group = _share(q // T.grain, first, count, chunks)
                for g in range(begin_group, end_group):
                    sizes_of_group(sizes, mi, g)
                    state, m = ti.static(
                        (T.group(S, g, sizes.group_items, T.lists(lists, g)), Tables(sizes, mi, mf))
                    )
                    if ti.static(T.narrow):
                        partial_group.squeeze(state, T)
                    work(state, terrain, m, given, begin, end)
                    _publish(state, m, readings, T)
                    if ti.static(T.narrow):
                        partial_group.spread(state, T)
                        partial_group.end_copies(state, m, T)

    return Kernel(kernel)
