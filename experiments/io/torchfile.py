"""Files of `torch.save` with a digest of all their bytes, which `torch.load` reads as any other.

The file is a zip archive, and the digest its comment. The checksums of the archive tell of changes
in its members, but not of all those in its directory: a wrong size let `torch.load` read on past
the end of what there was.
"""

from __future__ import annotations

import hashlib
import io
import zipfile
from pathlib import Path
from typing import Any

import torch

__all__ = ["load", "saved"]

_MARK = b"sha256:"
_LENGTH = len(_MARK) + 2 * hashlib.sha256().digest_size  # of the comment
_NO_COMMENT = bytes(2)  # at the end of a zip archive: the length of its comment
_COMMENT = _LENGTH.to_bytes(2, "little")


def saved(content: Any) -> bytes:
    """The bytes of a file.

    Args:
        content: Anything that `torch.load(weights_only=True)` reads.
    """
    buffer = io.BytesIO()
    torch.save(content, buffer)
    archive = buffer.getvalue()
    return archive.removesuffix(_NO_COMMENT) + _digest(archive)


def load(path: Path) -> tuple[Any, bool]:
    """What a file holds.

    Args:
        path: The file.

    Returns:
        The content, and whether the file has a digest; those of earlier versions have none.

    Raises:
        ValueError: the digest is wrong, or a checksum.
        Exception: whatever a damaged file makes `zipfile` and `torch.load` raise.
    """
    content = path.read_bytes()
    sealed = content[-_LENGTH:].startswith(_MARK)
    if sealed:
        end = len(content) - _LENGTH - len(_COMMENT)
        content, found = content[:end] + _NO_COMMENT, content[end:]
        if found != _digest(content):
            raise ValueError("wrong digest")
    with zipfile.ZipFile(io.BytesIO(content)) as archive:  # torch.load looks at no checksums
        if damaged := archive.testzip():
            raise ValueError(f"wrong checksum in {damaged}")
    return torch.load(io.BytesIO(content), weights_only=True), sealed


def _digest(archive: bytes) -> bytes:
    """What takes the place of an archive's empty comment."""
    return _COMMENT + _MARK + hashlib.sha256(archive).hexdigest().encode()
