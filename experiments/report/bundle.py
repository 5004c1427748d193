"""A campaign in few files, to be kept beside the code and read by anyone.

- champions.safetensors: of all conditions, NAME/genomes and NAME/fitness; options in the metadata.
- tables.zip: NAME/history.csv and whatever was measured of each condition; campaign.json.
- runs.csv: one row per run, the numbers that are looked up most.
- figures/: figures, tables and the report on the claims.
- SHA256SUMS: of the first three, as `sha256sum -c` reads it.

The same runs give the same bytes. `unpack` restores the folders of the runs, without checkpoints,
TensorBoard files and archives; a campaign goes on with them as finished.
"""

from __future__ import annotations

import hashlib
import io
import json
import math
import re
import tempfile
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path, PurePosixPath
from typing import Any

import safetensors
import safetensors.torch

from experiments.config import EvolveConfig
from experiments.io.atomic import write_atomically
from experiments.io.csvfile import write_csv
from experiments.io.formats import require_format
from experiments.io.outputs import require_folder
from experiments.report.figures.overview import takeoff_times
from experiments.report.figures.performance import unseen_per_run
from experiments.report.finished_runs import FinishedRuns, find_runs, gather
from experiments.runs.champions import Champions
from experiments.runs.names import CAMPAIGN, CONDITIONS

__all__ = ["is_bundle", "pack", "unpack", "unpacked"]

_CHAMPIONS, _TABLES, _RUNS, _SUMS = (
    "champions.safetensors",
    "tables.zip",
    "runs.csv",
    "SHA256SUMS",
)
_KEPT = (".csv", ".json", ".npz")
_KEY, _FORMAT = "hebbtorch", 1  # of what champions.safetensors says about itself
_DECIMAL = re.compile(rb"(?<=[,\n])-?\d+\.\d+(e[-+]?\d+)?(?=[,\r\n]|$)")  # a whole cell
_BEGINNING = (1980, 1, 1, 0, 0, 0)  # the time of every file in the archive, so that bytes agree
_COLUMNS = ("condition", "run", "seed", "speed", "unseen", "takeoff_generation")


def is_bundle(folder: Path) -> bool:
    """Whether a folder holds a packed campaign."""
    return (folder / _SUMS).is_file()


def pack(root: Path, out: Path, digits: int | None = None) -> list[Path]:
    """Put the finished runs of a campaign into few files.

    Args:
        root: folder of the campaign, or any folder with finished runs below it.
        out: a new or empty folder, or a bundle, whose files are replaced.
        digits: The significant digits of numbers in tables.zip; None: all, so that tables come back
            byte by byte. Champions and runs.csv always have all.

    Returns:
        The files.

    Raises:
        ValueError: `digits` is less than 1, there are no finished runs, two have the same name, or
            `out` holds something else; nothing was written then.
    """
    if digits is not None and digits < 1:
        raise ValueError(f"digits: expected an integer >= 1, or none to keep all, got {digits}")
    folders = _by_name(root)
    if out.is_file() or (out.is_dir() and any(out.iterdir()) and not is_bundle(out)):
        raise ValueError(f"out: expected a new or empty folder, or a bundle, got {str(out)!r}")
    require_folder(out)
    conditions = {name: gather([folder])[0] for name, folder in folders.items()}
    champions = {name: Champions.load(folder, as_recorded=True) for name, folder in folders.items()}
    out.mkdir(parents=True, exist_ok=True)
    write_atomically(out / _CHAMPIONS, _champions(champions))
    write_atomically(out / _TABLES, _tables(root, folders, digits))
    write_csv(out / _RUNS, _COLUMNS, _run_rows(conditions))
    files = [out / name for name in (_CHAMPIONS, _TABLES, _RUNS)]
    sums = "".join(f"{_sum(path)}  {path.name}\n" for path in files)
    write_atomically(out / _SUMS, sums.encode())
    return [*files, out / _SUMS]


def unpack(bundle: Path, out: Path) -> None:
    """Restore the folders of runs from a bundle.

    Args:
        bundle: a folder that `pack` wrote.
        out: a new or empty folder.

    Raises:
        ValueError: it is no bundle, a file of it is damaged, or `out` is not empty; nothing was
            written then.
    """
    if not is_bundle(bundle):
        raise ValueError(f"bundle: expected a packed campaign, got {str(bundle)!r} without {_SUMS}")
    _verify(bundle)
    if out.is_file() or (out.is_dir() and any(out.iterdir())):
        raise ValueError(f"out: expected a new or empty folder, got {str(out)!r}; choose another")
    require_folder(out)
    with zipfile.ZipFile(bundle / _TABLES) as archive:
        for name in archive.namelist():
            parts = PurePosixPath(_plain(name)).parts
            home = out if len(parts) == 1 else out / CONDITIONS / parts[0]
            home.mkdir(parents=True, exist_ok=True)
            write_atomically(home / parts[-1], archive.read(name))
    with safetensors.safe_open(bundle / _CHAMPIONS, framework="pt") as file:
        for name, options in _options(file.metadata() or {}).items():
            home = out / CONDITIONS / _plain(name)
            home.mkdir(parents=True, exist_ok=True)
            tensors = (file.get_tensor(f"{name}/{each}") for each in ("genomes", "fitness"))
            Champions(EvolveConfig.from_json(options), *tensors).save(home)


@contextmanager
def unpacked(roots: Sequence[Path]) -> Iterator[list[Path]]:
    """The same folders, but in place of each bundle a temporary one with its runs.

    Raises:
        ValueError: a bundle is damaged.
    """
    with ExitStack() as temporary:
        found = []
        for root in roots:
            if is_bundle(root):
                folder = Path(temporary.enter_context(tempfile.TemporaryDirectory()))
                unpack(root, folder)
                found.append(folder)
            else:
                found.append(root)
        yield found


def _by_name(root: Path) -> dict[str, Path]:
    folders: dict[str, Path] = {}
    for folder in find_runs([root]):
        other = folders.setdefault(folder.name, folder)
        if other != folder:
            raise ValueError(
                f"root: expected every run under a name of its own, got {str(other)!r} and "
                f"{str(folder)!r}; rename one"
            )
    if not folders:
        raise ValueError(f"root: expected finished runs at or below {str(root)!r}, found none")
    return folders


def _champions(champions: Mapping[str, Champions]) -> bytes:
    tensors, options = {}, {}
    for name, each in champions.items():
        tensors[f"{name}/genomes"] = each.genomes.contiguous()
        tensors[f"{name}/fitness"] = each.fitness.double().contiguous()
        options[name] = each.config.to_json()
    # One entry, since safetensors puts several into any order.
    metadata = {_KEY: json.dumps({"format": _FORMAT, "options": options})}
    return safetensors.torch.save(tensors, metadata=metadata)


def _options(metadata: Mapping[str, str]) -> Mapping[str, str]:
    """The options of each condition as JSON; the first bundles had an entry for each."""
    if _KEY not in metadata:
        return metadata
    about = json.loads(metadata[_KEY])
    require_format(about["format"], _FORMAT)
    options: Mapping[str, str] = about["options"]
    return options


def _plain(name: str) -> str:
    """A name in a bundle, if it stays within the folder that it is unpacked into.

    Raises:
        ValueError: it leads out of it.
    """
    path = PurePosixPath(name)
    if path.is_absolute() or ".." in path.parts or "\\" in name or not path.parts:
        raise ValueError(f"bundle: expected names within it, got {name!r}; do not trust it")
    return name


def _tables(root: Path, folders: Mapping[str, Path], digits: int | None) -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        members = {
            f"{name}/{path.name}": path
            for name, folder in folders.items()
            for path in folder.iterdir()
            if path.suffix in _KEPT
        }
        if (root / CAMPAIGN).is_file():
            members[CAMPAIGN] = root / CAMPAIGN
        for name, path in sorted(members.items()):
            info = zipfile.ZipInfo(name, _BEGINNING)
            info.external_attr = 0o644 << 16
            data = path.read_bytes()
            if digits is not None and path.suffix == ".csv":
                data = _rounded(data, digits)
            archive.writestr(info, data, zipfile.ZIP_DEFLATED, 9)
    return content.getvalue()


def _rounded(table: bytes, digits: int) -> bytes:
    """A table with so many significant digits of each number that has a decimal point."""
    return _DECIMAL.sub(lambda number: f"{float(number[0]):.{digits}g}".encode(), table)


def _run_rows(conditions: Mapping[str, FinishedRuns]) -> Iterator[tuple[Any, ...]]:
    for name, condition in conditions.items():
        unseen, takeoff = unseen_per_run(condition), takeoff_times(condition)
        for run, (_, _, seed) in enumerate(condition.sources):
            generation: float = math.nan  # never, or not known
            if len(takeoff) and takeoff.happened[run]:
                generation = int(takeoff.times[run])
            on_unseen = float(unseen[run]) if len(unseen) else math.nan
            yield name, run, seed, float(condition.fitness[run]), on_unseen, generation


def _verify(bundle: Path) -> None:
    for line in (bundle / _SUMS).read_text(encoding="utf-8").splitlines():
        expected, name = line.split(maxsplit=1)
        path = bundle / name
        if not path.is_file() or _sum(path) != expected:
            raise ValueError(
                f"bundle: expected {str(path)!r} as it was packed, got another or none (its "
                "checksum differs); take a good copy"
            )


def _sum(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
