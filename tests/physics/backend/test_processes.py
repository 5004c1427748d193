"""Simulators in threads, forks, without a home, and beside other users of Taichi.

Each needs a process of its own. All share a cache, so that the scalar program is compiled once.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

WORK = """
import os, sys, torch, physics

def work(seed=0):
    sim = physics.Simulator("box-1x1", None, 1, seed=seed, lanes=1, threads=1)
    sim.run(torch.ones(9, 1, 1))
    return sim.area_ratios().item()
"""

THREADS = """
from concurrent.futures import ThreadPoolExecutor

with ThreadPoolExecutor(4) as pool:
    found = list(pool.map(work, range(8)))
assert found == [work()] * 8, found
"""

FORK = """
import multiprocessing

sim = physics.Simulator("box-1x1", None, 1, lanes=1, threads=1)
sim.run(torch.ones(4, 1, 1))
expected = work()

def child():
    sim.run(torch.ones(5, 1, 1))
    assert sim.area_ratios().item() == expected == work()

process = multiprocessing.get_context("fork").Process(target=child)
process.start()
process.join()
assert process.exitcode == 0
child()
"""

C_FORK = """
import ctypes

expected = work()
pid = ctypes.CDLL(None).fork()  # Python's hooks do not hear of it
if pid == 0:
    try:
        work()
    except ValueError as error:
        os._exit(7 if "spawn" in str(error) else 8)
    os._exit(9)
assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 7
assert work() == expected
"""

TAICHI_BEFORE = """
from physics.backend import ti

ti.init(arch=ti.cpu)
theirs = ti.field(ti.f32, shape=4)
theirs.fill(3.0)
try:
    work()
except ValueError as error:
    assert "taichi: expected to start Taichi" in str(error)
else:
    raise AssertionError
assert theirs.to_numpy().tolist() == [3.0] * 4
"""

TAICHI_AFTER = """
from physics.backend import ti

sim = physics.Simulator("box-1x1", None, 1, lanes=1, threads=1)
ti.init(arch=ti.cpu)
for call in (work, lambda: sim.step(torch.zeros(1, 1))):
    try:
        call()
    except ValueError as error:
        assert "taichi: expected to be the only user of Taichi" in str(error)
    else:
        raise AssertionError
"""


# Large tensors are computed by several threads, which a fork lacks.
FORK_AFTER_OPENMP = """
import multiprocessing

torch.set_num_threads(2)
compute = lambda: torch.ones(4_000_000).sum()
compute()
process = multiprocessing.get_context("fork").Process(target=compute)
process.start()
process.join(120)
ended = process.exitcode
process.kill()
assert ended == 0
"""


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An empty cache of kernels; the first test of the module fills it."""
    return tmp_path_factory.mktemp("cache")


def run(script: str, cache: Path, **environment: str | None) -> subprocess.CompletedProcess[str]:
    """The end of a process that runs WORK and the script."""
    given = {**os.environ, "TI_OFFLINE_CACHE_FILE_PATH": str(cache), **environment}
    command = [sys.executable, "-c", WORK + script]
    known = {name: value for name, value in given.items() if value is not None}
    return subprocess.run(command, env=known, capture_output=True, text=True)


def test_threads_may_all_be_the_first(cache: Path) -> None:
    """Nothing is compiled before, and each of them would have to."""
    ended = run(THREADS, cache)
    assert ended.returncode == 0, ended.stderr


@pytest.mark.parametrize("script", [FORK, C_FORK, FORK_AFTER_OPENMP, TAICHI_BEFORE, TAICHI_AFTER])
def test_each_works_or_is_refused_and_the_process_ends_well(cache: Path, script: str) -> None:
    ended = run(script, cache)
    assert ended.returncode == 0, ended.stderr


@pytest.mark.parametrize("home", [None, "/proc/nowhere"])
def test_a_home_is_not_needed(cache: Path, tmp_path: Path, home: str | None) -> None:
    own_cache = None if home else str(cache)
    ended = run(
        "work()", tmp_path, HOME=home, TMPDIR=str(tmp_path), TI_OFFLINE_CACHE_FILE_PATH=own_cache
    )
    assert (ended.returncode, ended.stderr) == (0, "")
    if own_cache is None:
        (folder,) = tmp_path.iterdir()
        assert folder.stat().st_mode & 0o077 == 0
        assert any(path.is_file() for path in folder.rglob("*"))
