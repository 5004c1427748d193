"""A campaign on several Ray nodes, one of which is lost in the middle of a condition.

Each node is what ``ray start`` makes of a machine: processes of its own in a working directory of
its own, with its own path, a link, to the one folder that all share.
"""

import os
import secrets
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from experiments.campaign.launch import run_campaign
from experiments.campaign.options import CampaignOptions
from experiments.campaign.study import read_study
from tests.experiments.campaign.test_campaign_cluster import (
    NAMES,
    SCALE,
    finished_conditions,
    results,
)
from tests.experiments.held import held, lines, wait_for_lock

pytest.importorskip("ray")

DRIVER = """
import sys
import ray
from experiments.cli import main

arguments = [sys.argv.pop(1) for _ in range(4)]

def hook():
    from tests.experiments.held import hold_as

    hold_as(arguments)

environment = {"worker_process_setup_hook": hook}
ray.init(address=sys.argv.pop(1), log_to_driver=False, runtime_env=environment)
main()
"""
RAY = [sys.executable, "-m", "ray.scripts.scripts", "start", "--block", "--disable-usage-stats"]


def descendants(pid: int) -> list[int]:
    """Processes that a process started, and those that these started, the process first."""
    parents: dict[int, list[int]] = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue  # it has ended
        parents.setdefault(int(fields[1]), []).append(int(stat.parent.name))
    found = [pid]
    for each in found:
        found += parents.get(each, [])
    return found


def kill(node: subprocess.Popen[bytes]) -> None:
    """Everything of a node at once, as if its machine had lost its power."""
    for pid in descendants(node.pid):
        try:
            os.kill(pid, signal.SIGKILL)
        except ProcessLookupError:
            continue
    node.wait()


@contextmanager
def node(folder: Path, shared: Path, *options: str) -> Iterator[subprocess.Popen[bytes]]:
    """A node with a working directory and a path to the shared folder of its own."""
    folder.mkdir()
    (folder / "link").symlink_to(shared)
    environment = {
        **os.environ,
        "HEBBTORCH_CAMPAIGN_ROOT": str(folder / "link" / "root"),
        "PYTHONPATH": str(Path(__file__).parents[3]),
    }
    with (folder / "log").open("wb") as log:
        process = subprocess.Popen(
            [*RAY, *options], cwd=folder, env=environment, stdout=log, stderr=log
        )
    try:
        yield process
    finally:
        kill(process)


def free_port() -> int:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        port: int = listener.getsockname()[1]
        return port


def listens(port: int) -> bool:
    with socket.socket() as caller:
        return caller.connect_ex(("127.0.0.1", port)) == 0


@pytest.mark.long
def test_a_condition_goes_on_elsewhere_when_its_node_is_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RAY_AUTH_MODE", "token")  # nobody else may use these nodes
    monkeypatch.setenv("RAY_AUTH_TOKEN", secrets.token_hex(32))
    grid = tmp_path / "grid.toml"
    grid.write_text('[base]\nshape = "worm-2x1"\n[axes]\ncontroller = ["hebbian", "mlp"]\n')
    expected, shared = tmp_path / "expected", tmp_path / "shared"
    assert (
        run_campaign([read_study(grid)], CampaignOptions(out=expected, scale=SCALE, threads=1)) == 0
    )
    shared.mkdir()
    port = free_port()
    address = f"127.0.0.1:{port}"
    worker = ("--address", address, "--num-cpus", "1")
    arguments = f"{address} campaign --grid {grid} --out {shared / 'root'} --cluster ray"
    arguments += " --runs 2 --population 8 --generations 4 --duration 0.5"
    folder = shared / "root" / "conditions" / NAMES[0]
    with ExitStack() as nodes:
        head = ("--head", "--port", str(port), "--num-cpus", "0", "--include-dashboard", "false")
        nodes.enter_context(node(tmp_path / "head", shared, *head))
        while not listens(port):
            time.sleep(0.2)
        lost = nodes.enter_context(node(tmp_path / "lost", shared, *worker))
        with held(arguments, folder, 2, code=DRIVER) as driver:
            nodes.enter_context(node(tmp_path / "other", shared, *worker))
            kill(lost)
            wait_for_lock(folder)
            assert len(lines(folder)) == 1 + 2 * 2
            out, err = driver.communicate()
    assert driver.returncode == 0, err
    told = finished_conditions(out)
    assert list(told) == ["[1/2]", "[2/2]"]
    assert sorted(told.values()) == sorted(NAMES)
    for name in NAMES:
        assert results(shared / "root", name) == results(expected, name)
