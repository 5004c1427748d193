"""One side of a comparison: lets robots live for as long as it is told, and tells the CPU time.

A script that the comparison runs in a process for each checkout, with that checkout first on
Python's path; it therefore asks no more of a checkout than `experiments.bench.workload`.

    python -P comparison_worker.py CHECKOUT KIND SHAPE WORLDS SEED

It answers with lines of JSON: one when it is ready, or what is wrong; then, for each line with a
number of steps, [CPU time of these steps in s, a digest of all poses after them].
"""

import hashlib
import json
import sys
import time
from pathlib import Path
from typing import Any


def _workload(checkout: Path, kind: str, shape: str, worlds: int, seed: int) -> Any:
    """The robots, from that checkout's code."""
    _forget_installed(checkout)
    import experiments.bench.workload as workload

    for name, module in list(sys.modules.items()):
        file = getattr(module, "__file__", None)
        ours = name.partition(".")[0] in ("experiments", "hebbtorch", "physics")
        if ours and file and checkout not in Path(file).resolve().parents:
            raise ImportError(f"{name} is not in it")
    if kind == "open":
        return workload.OpenLoop(shape, worlds, seed)
    if kind == "own":
        return workload.OwnModule(shape, worlds, seed)
    return workload.ClosedLoop(shape, kind, worlds, seed)  # type: ignore[arg-type]


def _forget_installed(checkout: Path) -> None:
    """Keeps Python from completing the checkout with modules of the program that is installed.

    `experiments` is a namespace, of which Python joins all the folders that it finds.
    """
    sys.meta_path[:] = [
        finder for finder in sys.meta_path if "editable" not in getattr(finder, "__module__", "")
    ]
    import experiments

    experiments.__path__ = [str(checkout / "experiments")]


def _main() -> None:
    checkout, kind, shape, worlds, seed = sys.argv[1:]
    try:
        robots = _workload(Path(checkout).resolve(), kind, shape, int(worlds), int(seed))
    except Exception as error:  # whatever an unknown checkout's code may raise
        _say(f"{type(error).__name__}: {error}")
        return
    _say("ready")
    for line in sys.stdin:
        call = robots.stretch(int(line))
        started = time.process_time()
        call()
        seconds = time.process_time() - started
        poses = robots.sim.mass_poses().contiguous().numpy().tobytes()
        _say([seconds, hashlib.sha256(poses).hexdigest()])


def _say(answer: object) -> None:
    print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    _main()
