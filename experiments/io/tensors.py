"""Files of tensors and the options they belong to, with a digest over all that is in them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from hashlib import blake2b
from pathlib import Path

import safetensors
import safetensors.torch
import torch
from torch import Tensor

from experiments.io.atomic import write_atomically
from experiments.io.formats import require_format
from experiments.io.terminal import LOG

__all__ = ["read_tensors", "write_tensors"]

_KEY = "hebbtorch"
_FORMAT = 1


def write_tensors(path: Path, tensors: Mapping[str, Tensor], config: str) -> None:
    """Replace a file; it is never seen half written.

    Args:
        path: The file to write or read.
        tensors: The tensors by name.
        config: The options that they belong to, as JSON.
    """
    contents = {name: tensor.detach().cpu().contiguous() for name, tensor in tensors.items()}
    about = {"format": _FORMAT, "digest": _digest(contents, config), "config": config}
    # One entry, since safetensors puts several into any order.
    metadata = {_KEY: json.dumps(about)}
    write_atomically(path, safetensors.torch.save(contents, metadata=metadata))


def read_tensors(path: Path, names: Sequence[str]) -> tuple[dict[str, Tensor], str]:
    """What `write_tensors` wrote. Files of before there was a digest are read with a warning.

    Args:
        path: An existing file.
        names: The names of the tensors in it.

    Returns:
        The tensors by name, and the options as JSON.

    Raises:
        ValueError: The file is damaged, in a newer format, or holds other tensors.
    """
    try:
        with safetensors.safe_open(path, framework="pt") as file:
            metadata = file.metadata() or {}
            # Copies: what is read is a map of the file, and changes with it.
            found = {name: file.get_tensor(name).clone() for name in file.keys()}  # noqa: SIM118
    except (safetensors.SafetensorError, OSError, ValueError, TypeError, KeyError) as error:
        raise ValueError(str(error) or type(error).__name__) from error
    if metadata.keys() == {"config"}:
        LOG.warning("%s was written before files had a digest; its content is not checked", path)
        config = metadata["config"]
    else:
        config = _checked_config(metadata, found)
    if sorted(found) != sorted(names):
        raise ValueError(f"expected the tensors {', '.join(names)}, got {', '.join(found)}")
    return found, config


def _checked_config(metadata: Mapping[str, str], tensors: Mapping[str, Tensor]) -> str:
    """The options of a file whose digest is right."""
    try:
        about = json.loads(metadata[_KEY])
        require_format(about["format"], _FORMAT)
        config, digest = about["config"], about["digest"]
        if digest != _digest(tensors, config):
            raise ValueError("its content does not match its digest: the file is damaged")
    except (KeyError, TypeError, AttributeError, RecursionError) as error:
        raise ValueError("it has no options that can be read: the file is damaged") from error
    return str(config)


def _digest(tensors: Mapping[str, Tensor], config: str) -> str:
    """Of the options, and of every tensor's name, type, shape and bytes."""
    state = blake2b(digest_size=16)
    for name in sorted(tensors):
        tensor = tensors[name]
        for text in (name, str(tensor.dtype), str(tuple(tensor.shape))):
            state.update(text.encode() + b"\0")
        if tensor.numel() > 0:
            state.update(tensor.contiguous().reshape(-1).view(torch.uint8).numpy().tobytes())
    state.update(config.encode())
    return state.hexdigest()
