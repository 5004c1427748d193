"""The command: reads a folder of recorded runs, replays each, and judges."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from experiments.io.outputs import make_room
from experiments.validate import (
    batches,
    champions,
    falls,
    flight,
    gaits,
    golden,
    random_genomes,
    sensors,
    steep,
    steps,
    table,
    terrains,
    trajectories,
)
from experiments.validate.case import Case, Outcome, Setting, Skip
from experiments.validate.recordings import Recordings
from physics import Engine, checks

__all__ = ["OWN_COPY", "validate"]

OWN_COPY = Path(__file__).parent / "reference"
_PLAIN_WIDTH = 150  # of a table that does not go to a terminal


def validate(
    reference: Path | None = None,
    json: Path | None = None,
    out: Path | None = None,
    *,
    seed: int = 0,
    engine: Engine | None = None,
    device: str = "cpu",
    trajectories_of: Sequence[Path] = (),
) -> int:
    """Compares the simulator and the controllers with recorded runs and prints a table.

    Args:
        reference: folder of recorded runs; default: the package's own copy.
        json: file for the table in JSON.
        out: folder for pictures of recorded runs and ours.
        seed: The seed of the motions in the cases that need no recorded run.
        engine: the simulator's settings; others than the default are a wrong model.
        device: where to simulate, "cpu" or "cuda".
        trajectories_of: files with recorded trajectories, which are then replayed instead.

    Returns:
        0 if every case passes, else 1. A case whose files are missing is skipped.

    Raises:
        ValueError: the folder is missing or holds nothing to replay, or a file is broken; PyTorch
            finds no such device; or the results cannot be written where they should.
    """
    device = checks.device(device).type
    console = Console(highlight=False)
    if not console.is_terminal:
        console = Console(highlight=False, width=_PLAIN_WIDTH)
    folder = OWN_COPY if reference is None else reference
    if trajectories_of:
        found = trajectories.cases(trajectories_of)
    else:
        found = _collect(Recordings(folder))
    make_room(json, out)
    outcomes: list[Outcome | Skip] = []
    setting = Setting(engine or Engine(), seed, device)
    n_cases = sum(isinstance(case, Case) for case in found)
    for case in found:
        if isinstance(case, Skip):
            outcomes.append(case)
            continue
        started = time.perf_counter()
        outcomes.append(case.replay(setting))
        done = sum(isinstance(outcome, Outcome) for outcome in outcomes)
        console.print(f"{done}/{n_cases} {case.name}: {time.perf_counter() - started:.1f} s")
    return _conclude(console, outcomes, folder, setting, json, out)


def _collect(recordings: Recordings) -> list[Case | Skip]:
    """All cases that the folder's files allow, quick ones first."""
    recorded = [
        *terrains.cases(recordings),
        *golden.cases(recordings),
        *steps.cases(recordings),
        *falls.cases(recordings),
        *sensors.cases(recordings),
        *gaits.cases(recordings),
        *steep.cases(recordings),
        *random_genomes.cases(recordings),
        *champions.cases(recordings),
    ]
    if not any(isinstance(case, Case) for case in recorded):
        raise ValueError(
            f"reference: expected recorded runs, such as passive_worm.csv, in {recordings.folder}, "
            "got none"
        )
    return [*recorded, *falls.own_cases(), *flight.cases(recordings), *batches.cases()]


def _conclude(
    console: Console,
    outcomes: list[Outcome | Skip],
    folder: Path,
    setting: Setting,
    json: Path | None,
    out: Path | None,
) -> int:
    """Shows and writes everything; the exit code."""
    rows = [
        row
        for outcome in outcomes
        for row in ((outcome,) if isinstance(outcome, Skip) else outcome.rows)
    ]
    results = [outcome for outcome in outcomes if isinstance(outcome, Outcome)]
    self_agreements = [
        self_agreement for result in results for self_agreement in result.self_agreements
    ]
    table.show_rows(console, rows)
    table.show_self_agreements(console, self_agreements)
    verdicts = [table.verdict(row) for row in rows]
    if json is not None:
        table.write_json(json, folder, setting, rows, self_agreements)
        console.print(f"wrote {json}")
    if out is not None:
        from experiments.validate import plots

        for path in plots.draw([p for result in results for p in result.pictures], out):
            console.print(f"wrote {path}")
    counts = {word: verdicts.count(word) for word in ("pass", "FAIL", "skipped")}
    console.print(", ".join(f"{count} {word}" for word, count in counts.items()))
    return int(counts["FAIL"] > 0)
