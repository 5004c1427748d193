"""What a network is besides its parameters, kept in its `state_dict` and checked on loading."""

from __future__ import annotations

import json
import warnings
from abc import ABC, abstractmethod
from typing import Any

import torch
from torch import Tensor, nn

_FORMAT = 1
_KEY = "_extra_state"  # torch's name for it
_last_load: list[list[str]] = [[]]  # the list of missing keys of the load that was warned about


class Described(nn.Module, ABC):
    """A module whose `state_dict` also holds its options, as bytes of JSON in a tensor.

    Parameters of one learning rate, bound or sharing make no sense in a network of another one:
    loading them raises. A `state_dict` from before these options were kept loads with a warning.
    """

    @abstractmethod
    def dynamics(self) -> dict[str, Any]:
        """Name -> value of every option that decides what the parameters mean."""

    def get_extra_state(self) -> Tensor:
        """The options, as the `state_dict` holds them: (bytes,) uint8."""
        text = json.dumps({"format": _FORMAT, **self.dynamics()}, sort_keys=True)
        return torch.tensor(list(text.encode()), dtype=torch.uint8, device="cpu")

    def set_extra_state(self, state: Tensor) -> None:
        """Nothing to do: they were checked."""

    def check_dynamics(self, given: Tensor | None, where: str) -> None:
        """Compare options with this module's own.

        Args:
            given: The options of the saved module, as `get_extra_state` gives them.
            where: name of the module, for the error's message.

        Raises:
            ValueError: they differ, or are none.
        """
        try:
            theirs = json.loads(bytes(given.tolist()))  # type: ignore[union-attr]
            version = theirs.pop("format")
        except (ValueError, AttributeError, TypeError, KeyError):
            raise ValueError(f"state_dict: expected the options of {where}, got no JSON") from None
        if version > _FORMAT:
            raise ValueError(
                f"state_dict: expected format {_FORMAT} or older, got {version}; "
                f"it is of a newer hebbtorch"
            )
        ours = json.loads(json.dumps(self.dynamics()))
        for name, value in theirs.items():
            if ours.get(name) != value:
                raise ValueError(
                    f"state_dict: expected {name} = {ours.get(name)!r} as {where} has it, "
                    f"got parameters of {name} = {value!r}; build the network with that option"
                )

    def _load_from_state_dict(
        self,
        state_dict: dict[str, Any],
        prefix: str,
        local_metadata: dict[str, Any],
        strict: bool,
        missing_keys: list[str],
        *rest: Any,
    ) -> None:
        described = [(n, m) for n, m in self.named_modules() if isinstance(m, Described)]
        for name, module in described:  # before anything is written
            key = f"{prefix}{name}.{_KEY}" if name else prefix + _KEY
            where = f"{type(module).__name__} {key.removesuffix(_KEY).rstrip('.')}".rstrip()
            if key in state_dict:
                module.check_dynamics(state_dict[key], where)
            elif missing_keys is not _last_load[0]:
                _last_load[0] = missing_keys
                warnings.warn(
                    "state_dict: it does not say which learning rate, sharing and bounds its "
                    "parameters belong to; make sure that this network's are the same",
                    stacklevel=4,
                )
        given = {prefix + _KEY: self.get_extra_state(), **state_dict}
        super()._load_from_state_dict(given, prefix, local_metadata, strict, missing_keys, *rest)


def option(value: Any) -> Any:
    """An option as JSON can hold it: a function by its name."""
    if isinstance(value, nn.Module):
        return type(value).__qualname__
    return getattr(value, "__qualname__", type(value).__qualname__) if callable(value) else value
