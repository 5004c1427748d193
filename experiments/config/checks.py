"""Checks of an evolution's options, and that they fit together; nothing is written."""

from __future__ import annotations

import dataclasses
import math
from types import NoneType
from typing import Any, Literal, get_args, get_origin, get_type_hints

from experiments.config.options import options_of

__all__ = ["check", "on_this_machine"]

_KINDS = {bool: "true or false", str: "text"}
_BYTES = 40  # of a synapse or a voxel, at least


def check(config: Any, *, machine: bool = True) -> None:
    """Check every option of an evolution.

    Args:
        config: An `EvolveConfig`; that module imports this one.
        machine: whether to check that this machine can compute it, too.

    Raises:
        ValueError: the first option that is wrong: its name, what was expected, what came and how
            to mend it.
    """
    for each in (
        _check_kinds, _check_choices, _check_numbers, _check_controller, _check_network,
        _check_world,
    ):  # fmt: skip
        each(config)
    if machine:
        _check_device(config)
        _check_size(config)


def on_this_machine(config: Any) -> Any:
    """The options of an `EvolveConfig`, with the CPU in place of a device that is not there."""
    try:
        _check_device(config)
    except ValueError:
        return dataclasses.replace(config, device="cpu")
    return config


def _check_kinds(config: Any) -> None:
    """Refuse what is of another kind than an option can be; a file may hold anything."""
    for field in dataclasses.fields(config):
        value, default = getattr(config, field.name), field.default
        kinds: tuple[type, ...] = (str, int, float, NoneType)
        if isinstance(default, bool):
            kinds = (bool,)
        elif isinstance(default, str):
            kinds = (str,)
        if not isinstance(value, kinds) or isinstance(value, bool) != isinstance(default, bool):
            words = "a number or text" if len(kinds) > 1 else _KINDS[kinds[0]]
            raise ValueError(f"{field.name}: expected {words}, got {value!r}")


def _check_choices(config: Any) -> None:
    for name, hint in get_type_hints(type(config)).items():
        allowed = get_args(hint) if get_origin(hint) is Literal else None
        value = getattr(config, name)
        if allowed and value not in allowed:
            raise ValueError(f"{name}: expected one of {', '.join(allowed)}, got {value!r}")


def _check_numbers(config: Any) -> None:
    hints = get_type_hints(type(config))
    for name, what in options_of(type(config)).items():
        value = getattr(config, name)
        if what.least is None or (value is None and getattr(type(config), name) is None):
            continue
        is_kind, words = _is_finite, "a finite number"
        if int in (hints[name], *get_args(hints[name])):
            is_kind, words = _is_integer, "an integer"
        if not is_kind(value) or value < what.least:
            raise ValueError(f"{name}: expected {words} >= {what.least}, got {value!r}")
    if config.damage_probability > 1:
        raise ValueError(
            f"damage_probability: expected a number in [0, 1], got {config.damage_probability!r}"
        )
    from physics import steps_in

    steps_in(config.duration)
    if config.sigma == 0:
        raise ValueError("sigma: expected a number > 0, got 0; nothing would evolve")
    if not _is_finite(config.gain) or config.gain == 0:
        raise ValueError(f"gain: expected a finite number other than 0, got {config.gain!r}")
    if config.eta != "evolved" and not _is_finite(config.eta):
        raise ValueError(f'eta: expected a finite number or "evolved", got {config.eta!r}')


def _check_controller(config: Any) -> None:
    default = type(config)()
    for name, what in options_of(type(config)).items():
        value = getattr(config, name)
        has_it = not what.controllers or config.controller in what.controllers
        if not has_it and value != getattr(default, name):
            raise ValueError(
                f"{name}: expected no such option with controller {config.controller}, got "
                f"{value!r}; drop it or use controller {' or '.join(what.controllers)}"
            )


def _check_network(config: Any) -> None:
    """The layers know their own options and what to say of wrong ones."""
    import torch

    import hebbtorch

    network = hebbtorch.HebbianMLP(
        [1, 1],
        groups=["input"] if config.sharing == "grouped" else None,
        **config.plastic_options(),
    )
    network.initial_state(generator=torch.Generator())


def _check_damage(config: Any, n_voxels: int) -> None:
    """See that damage comes within the episode and meets voxels that there are."""
    numbers = config.voxels_that_break()
    if any(number >= n_voxels for number in numbers):
        raise ValueError(
            f"damage_voxels: expected numbers from 0 to {n_voxels - 1}, the voxels of "
            f"{config.shape}, got {config.damage_voxels!r}"
        )
    start = config.duration / 2 if config.damage_time is None else config.damage_time
    if config.damage_until is not None and config.damage_until <= start:
        raise ValueError(
            f"damage_until: expected more than {start:g} s, when voxels break, got "
            f"{config.damage_until!r}"
        )


def _check_world(config: Any) -> None:
    from physics import Apparatus, Morphology, Terrain

    morphology = Morphology.from_name(config.shape)
    apparatus = Apparatus.of(config.sensors, morphology)
    _check_damage(config, morphology.n_voxels)
    if apparatus.n_readings == 0:
        raise ValueError(
            f"sensors: expected at least one reading, got none from {config.sensors!r} on "
            f"{config.shape!r}; choose a richer apparatus"
        )
    Terrain.from_name(config.terrain, seed=0)


def _check_device(config: Any) -> None:
    from physics import checks

    try:
        checks.device(config.device)
    except RuntimeError:  # PyTorch's, for a name that it does not know
        raise ValueError(f"device: expected cpu or cuda, got {config.device!r}") from None


def _check_size(config: Any) -> None:
    """See that a generation fits into memory, by the least that networks and worlds take."""
    from physics import Apparatus, Morphology, checks

    morphology = Morphology.from_name(config.shape)
    inputs, outputs = (
        Apparatus.of(config.sensors, morphology).n_readings,
        morphology.n_voxels,
    )
    synapses = inputs * (inputs + outputs)
    checks.require_memory(
        "population", config.runs * config.population, _BYTES * (synapses + outputs)
    )


def _is_integer(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_finite(value: Any) -> bool:
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return is_number and math.isfinite(value)
