"""The kernels: loops over groups of worlds and over steps.

A kernel takes few, packed tensors because each costs some 8 microseconds per launch, and runs
all its steps for one group before it turns to the next: the group's state stays in the cache.
"""

from collections.abc import Callable
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

from physics import actuate, backend, ground, meetings
from physics import layout as lay
from physics.backend import Program, ti
from physics.model import load_sizes
from physics.sensing import sense
from physics.step import engine_step


@ti.func
def _publish(S: ti.template(), g, m: ti.template(), readings: ti.template(), T: ti.template()):
    """Copies the readings of a group to the caller's (N, R) tensor."""
    for lane in range(T.lanes):
        world = g * T.lanes + lane
        if world < readings.shape[0]:
            for r in range(m.readings):
                readings[world, r] = S[g, m.reading_block + r][lane]


@ti.func
def _take_commands(
    S: ti.template(), g, m: ti.template(), actions: ti.template(), t, T: ti.template()
):
    """Copies row t of the caller's (steps, N, V) actuations to a group."""
    for v in range(m.voxels):
        o = v * lay.VOXEL_ITEMS + lay.COMMAND
        for lane in range(T.lanes):
            world = g * T.lanes + lane
            if world < actions.shape[1]:
                S[g, o][lane] = actions[t, world, v]
        actuate.command(S, g, m, v, S[g, o], T)


@lru_cache
def kernels(program: Program) -> SimpleNamespace:
    """The kernels that need no controller: ``look`` (contacts and readings of the present
    poses) and ``play`` (steps under given actuations)."""
    backend.start(program.device)
    T = backend.real(program)

    @ti.kernel
    def look(
        S: T.array,  # type: ignore[name-defined]
        lists: backend.integers(2),  # type: ignore[valid-type]
        terrain: T.scalars(3),  # type: ignore[valid-type]
        mi: backend.integers(1),  # type: ignore[valid-type]
        mf: T.scalars(1),  # type: ignore[valid-type]
        readings: T.scalars(2),  # type: ignore[valid-type]
    ):
        state, contacts = ti.static((T.view(S), T.view(lists)))
        for g in range(state.groups):
            m = load_sizes(mi)
            ground.update_window(state, terrain, g, m, mf, T)
            ground.detect(state, contacts, g, m, T)
            if ti.static(T.features.self_collision):
                meetings.detect(state, contacts, g, m, mi, T)
            sense(state, g, m, mi, mf, T)
            _publish(state, g, m, readings, T)

    @ti.kernel
    def play(
        S: T.array,  # type: ignore[name-defined]
        lists: backend.integers(2),  # type: ignore[valid-type]
        terrain: T.scalars(3),  # type: ignore[valid-type]
        mi: backend.integers(1),  # type: ignore[valid-type]
        mf: T.scalars(1),  # type: ignore[valid-type]
        actions: T.scalars(3),  # type: ignore[valid-type]
        readings: T.scalars(2),  # type: ignore[valid-type]
        chunks: ti.i32,
    ):
        state, contacts = ti.static((T.view(S), T.view(lists)))
        for q in range(chunks * T.grain):
            if q % T.grain == 0:
                m = load_sizes(mi)
                chunk = q // T.grain
                for g in range(
                    chunk * state.groups // chunks, (chunk + 1) * state.groups // chunks
                ):
                    for t in range(actions.shape[0]):
                        _take_commands(state, g, m, actions, t, T)
                        engine_step(state, contacts, terrain, g, m, mi, mf, T)
                        sense(state, g, m, mi, mf, T)
                    _publish(state, g, m, readings, T)

    return SimpleNamespace(look=backend.Kernel(look), play=backend.Kernel(play))


def closed_loop(program: Program, controller: Callable[..., Any]) -> Any:
    """A kernel that runs whole stretches of life with the controller inside.

    Args:
        program: what it is compiled for.
        controller: a Taichi function ``(S, brain, g, m, T)`` that reads the readings from
            ``S[g, m.reading_block + r]`` and calls ``physics.actuate.command`` for every voxel;
            ``brain`` is a tensor (groups, items, lanes) of its own.

    Returns:
        ``kernel(S, lists, terrain, mi, mf, brain, steps, chunks)``.
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
        brain: T.array,  # type: ignore[name-defined]
        steps: ti.i32,
        chunks: ti.i32,
    ):
        state, contacts, network = ti.static((T.view(S), T.view(lists), T.view(brain)))
        for q in range(chunks * T.grain):
            if q % T.grain == 0:
                m = load_sizes(mi)
                chunk = q // T.grain
                for g in range(
                    chunk * state.groups // chunks, (chunk + 1) * state.groups // chunks
                ):
                    for _ in range(steps):
                        engine_step(state, contacts, terrain, g, m, mi, mf, T)
                        sense(state, g, m, mi, mf, T)
                        controller(state, network, g, m, T)

    return backend.Kernel(live)
