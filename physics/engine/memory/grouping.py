"""How a batch of worlds is cut: into groups of lanes, groups into parts, parts into chunks.

On a CPU the lanes of a group are worlds that are computed together, whether they are filled or
not, and each thread takes whole groups. No result depends on any of it.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from physics.backend import Program

_NARROW, _WIDE = 8, 16  # worlds per group
_NARROW_TIME = 0.75  # that a group of 8 float32 worlds takes, in groups of 16
_LONG_RUN = 60  # steps
_BLOCKS = (32, 64, 128, 192, 256, 384, 512)  # sizes of a block on a GPU
_BLOCKS_AT_ONCE = 2  # on a multiprocessor
_CHUNKS_PER_THREAD = 4  # where groups have different robots


@dataclass(frozen=True)
class Part:
    """Groups that one kernel simulates.

    Attributes:
        program: The program of the kernel.
        first: The number of the first group.
        count: The number of groups.
        chunks: into which a parallel loop over them is cut.
    """

    program: Program
    first: int
    count: int
    chunks: int


def lanes_for(n_worlds: int, dtype: torch.dtype, threads: int | None, device: str) -> int:
    """The fastest number of worlds per group.

    Sixteen float32 worlds fill the widest vectors, and take less time than twice eight if they
    leave every thread something to do; in float64 eight already fill them. A GPU has threads
    enough for every world.
    """
    if device == "cuda":
        return 1
    if dtype == torch.float64:
        return _NARROW
    cores = _available(threads)
    narrow = _NARROW_TIME * _turns(-(-n_worlds // _NARROW), cores)
    wide = min(_turns(-(-n_worlds // _WIDE), cores), _time_with_tail(n_worlds, cores))
    return _WIDE if wide <= narrow else _NARROW


def block_for(n_worlds: int, device: str) -> int:
    """Threads of a block on a GPU, a thread for each world.

    The compiler gives a thread as many registers as two such blocks leave it on a multiprocessor:
    few worlds run fastest with many, and many worlds only if all of them run at once.
    """
    if device == "cpu":
        return _BLOCKS[0]
    places = _BLOCKS_AT_ONCE * torch.cuda.get_device_properties(0).multi_processor_count
    fitting = (block for block in _BLOCKS if block * places >= n_worlds)
    return next(fitting, _BLOCKS[-1])


def lanes_for_robots(
    counts: Sequence[int], dtype: torch.dtype, threads: int | None, device: str
) -> int:
    """The fastest number of worlds per group where groups have different robots.

    Args:
        counts: worlds of each robot.
        dtype: of the simulation.
        threads: at most so many; None: all cores.
        device: "cpu" or "cuda".
    """
    if len(counts) == 1 or device == "cuda" or dtype == torch.float64:
        return lanes_for(sum(counts), dtype, threads, device)
    narrow = sum(_NARROW_TIME * -(-count // _NARROW) for count in counts)
    wide = sum(min(-(-count // _WIDE), _time_with_tail(count, 1)) for count in counts)
    return _WIDE if wide < narrow else _NARROW


@dataclass(frozen=True)
class Grouping:
    """A batch of worlds, cut for one program or for two.

    Attributes:
        whole: All groups as one part.
        parts: all groups again, or the full ones and a narrow program for the others.
        robots: Which robot the next groups have, by its number, and how many groups.
    """

    whole: Part
    parts: tuple[Part, ...]
    robots: tuple[tuple[int, int], ...] = ((0, 1),)

    @classmethod
    def of_robots(cls, program: Program, counts: Sequence[int], threads: int | None) -> Grouping:
        """Cuts a batch so that the worlds of a group have the same robot.

        Groups that a narrow program can take come last. There are more chunks than threads, for
        robots differ in what they cost.

        Args:
            program: simulates all worlds of a group.
            counts: worlds of each robot.
            threads: at most so many; None: all cores.
        """
        if len(counts) == 1:
            return cls.of(program, counts[0], threads)
        wide, narrow = [], []
        can_halve = (program.dtype, program.lanes) == (torch.float32, _WIDE)
        can_halve = can_halve and program.device == "cpu"
        for robot, count in enumerate(counts):
            full, rest = divmod(count, program.places)
            is_narrow = can_halve and 0 < rest <= _NARROW
            if full + (rest > 0) - is_narrow > 0:
                wide.append((robot, full + (rest > 0) - is_narrow))
            if is_narrow:
                narrow.append((robot, 1))
        n_wide, n_narrow = (sum(n for _, n in part) for part in (wide, narrow))
        most = n_wide + n_narrow
        if program.device == "cpu":
            most = min(most, _CHUNKS_PER_THREAD * _available(threads))
        whole = Part(program, 0, n_wide + n_narrow, most)
        parts = [whole]
        if n_narrow:
            halved = program._replace(lanes=_NARROW)
            parts = [
                part
                for part in (
                    Part(program, 0, n_wide, min(n_wide, most)),
                    Part(halved, n_wide, n_narrow, min(n_narrow, most)),
                )
                if part.count
            ]
        return cls(whole, tuple(parts), (*wide, *narrow))

    def places(self, of_world: np.ndarray) -> np.ndarray:
        """The place of each world, (N,): those of a robot fill its groups in order.

        Args:
            of_world: number of each world's robot, (N,).
        """
        lanes = self.whole.program.places
        ends = lanes * np.cumsum([count for _, count in self.robots])
        free: dict[int, list[int]] = {}
        for (robot, count), end in zip(self.robots, ends.tolist(), strict=True):
            free.setdefault(robot, []).extend(range(end - lanes * count, end))
        places = np.empty(len(of_world), dtype=np.int64)
        for robot, own in free.items():
            worlds = np.flatnonzero(of_world == robot)
            places[worlds] = own[: len(worlds)]
        return places

    @classmethod
    def of(cls, program: Program, n_worlds: int, threads: int | None) -> Grouping:
        """The fastest way to cut a batch.

        Half a group of sixteen is left to a program of eight lanes where the others keep all
        threads equally busy: elsewhere its time is hidden beside theirs.

        Args:
            program: simulates all worlds of a group.
            n_worlds: The number of worlds, N.
            threads: The most threads to use; None: all cores.
        """
        groups = -(-n_worlds // program.places)
        if program.device == "cuda":
            whole = Part(program, 0, groups, groups)
            return cls(whole, (whole,))
        cores = _available(threads)
        whole = Part(program, 0, groups, min(groups, cores))
        wide = (program.dtype, program.lanes) == (torch.float32, _WIDE)
        if not wide or _turns(groups, cores) <= _time_with_tail(n_worlds, cores):
            return cls(whole, (whole,))
        full = Part(program, 0, groups - 1, min(groups - 1, cores))
        return cls(whole, (full, Part(program._replace(lanes=_NARROW), groups - 1, 1, 1)))

    def parts_for(self, steps: int) -> tuple[Part, ...]:
        """The parts, if so many steps in one call are worth the compilation of two programs."""
        return self.parts if steps >= _LONG_RUN else (self.whole,)


def _turns(groups: int, cores: int) -> int:
    """Groups that the busiest thread simulates, one after the other."""
    return -(-groups // cores)


def _time_with_tail(n_worlds: int, cores: int) -> float:
    """Of groups of 16 with a narrow program for the last one, if that is an option."""
    full, rest = divmod(n_worlds, _WIDE)
    possible = full > 0 and 0 < rest <= _NARROW
    return _turns(full, cores) + _NARROW_TIME if possible else float("inf")


def _available(threads: int | None) -> int:
    """Threads that may run: as many as asked for, or as this process has cores."""
    if threads is not None:
        return threads
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
