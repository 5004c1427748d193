"""The options of a run on disk, RUN/config.json, with a digest that tells of damage and edits."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from experiments.config import EvolveConfig
from experiments.io.atomic import write_atomically
from experiments.io.formats import require_format
from experiments.runs.names import CONFIG

__all__ = ["read_config", "write_config"]

_FORMAT = 2  # with a digest; files in format 1 have none


def write_config(folder: Path, config: EvolveConfig) -> None:
    """Replace the file.

    Args:
        folder: The folder of the run.
        config: The options.

    Raises:
        OSError: it cannot be written.
    """
    options = {**json.loads(config.to_json()), "format": _FORMAT}
    text = json.dumps({**options, "digest": _digest(options)}, indent=2) + "\n"
    write_atomically(folder / CONFIG, text.encode())


def read_config(folder: Path) -> EvolveConfig:
    """The options of a run.

    Args:
        folder: The folder of the run.

    Raises:
        ValueError: the folder is not a run's, or its options cannot be read or are not those that
            were written.
    """
    path = folder / CONFIG
    if not path.is_file():
        raise ValueError(
            f"run: expected the folder of a run, got {str(folder)!r} without {CONFIG}; "
            "name a folder that `hebbtorch evolve` wrote"
        )
    try:
        text = path.read_text(encoding="utf-8-sig")
        config = EvolveConfig.from_json(_checked(text))
        config.validate(machine=False)
    except (ValueError, OSError) as error:
        raise ValueError(f"run: cannot use {str(path)!r}: {error}") from error
    return config


def _checked(text: str) -> str:
    """The options alone, once the digest was found right."""
    try:
        options = json.loads(text)
    except (ValueError, RecursionError):
        return text  # for `from_json` to say what is wrong with it
    if not isinstance(options, dict) or options.get("format", 1) == 1:
        return text
    require_format(options["format"], _FORMAT)
    if options.pop("digest", None) != _digest(options):
        raise ValueError(
            "digest: expected the one of these options, got another, so they were changed or "
            "damaged since they were written; undo the change or put back a copy"
        )
    return json.dumps({**options, "format": 1})


def _digest(options: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(options, sort_keys=True).encode()).hexdigest()[:16]
