"""What an evolution is: every option of a run, checked before anything is written.

This module imports neither torch nor the simulator at the top, so that the command line can
show its help at once.
"""

from __future__ import annotations

import dataclasses
import json
import math
from dataclasses import dataclass
from typing import Any, Literal, get_args, get_origin, get_type_hints

from experiments.options import option, options_of

__all__ = ["EvolveConfig"]

_LEAST_DURATION = 0.1  # [s]
_LEAST_POPULATION = 4  # of which a quarter are parents
_PLASTIC = ("hebbian",)  # controllers with plasticity
_SPELLINGS: dict[str, dict[str, str | None]] = {
    "normalize": {"none": None, "None": None},
    "init": {"zero": "zeros"},
}
"""How the command line, TOML files and earlier versions write some values."""


@dataclass(frozen=True)
class EvolveConfig:
    """Everything that decides the outcome of an evolution; the defaults are the paper's.

    Options that make another condition stand in the order in which they make its name.
    """

    shape: str = option("biped-4x3", "axis")
    """Robot: biped-WxH, worm-WxH, box-WxH, tripod-WxH, comb-WxH, T-WxH or ball-D."""

    sensors: str = option("low", "axis")
    """Sensory apparatus: low, medium or high."""

    controller: Literal["hebbian", "mlp"] = option("hebbian", "axis")
    """Plastic network whose rules evolve, or static network whose weights evolve."""

    sharing: str = option(
        "full",
        "variant",
        label={
            "grouped": "sensors",
            "presynaptic": "pre-synaptic",
            "postsynaptic": "post-synaptic",
        },
        controllers=_PLASTIC,
    )
    """Which synapses share a rule: full (none do), single (all do), presynaptic (those that enter
    a neuron), postsynaptic (those that leave it) or grouped (those of one kind of sensor)."""

    normalize: str | None = option(
        None,
        "variant",
        suffix=lambda value: "normalized" if value == "l2" else f"normalized-{value}",
        label={"l2": "normalized", "minmax": "min-max"},
        controllers=_PLASTIC,
    )
    """none: weights as the rules leave them; l2: every neuron's incoming weights scaled to norm 1
    (the paper's text); minmax: mapped onto [-1, 1] (the paper's code)."""

    eta: float | Literal["evolved"] = option(
        0.01,
        "variant",
        suffix=lambda value: f"eta-{value}",
        label=lambda value: "η evolved" if value == "evolved" else f"η = {value}",
        controllers=_PLASTIC,
    )
    """Learning rate, or "evolved" for one gene per rule."""

    init: str = option(
        "zeros",
        "variant",
        suffix=lambda value: f"init-{value}",
        label={"uniform": "U(-1, 1)"},
        controllers=_PLASTIC,
    )
    """Initial weights: zeros, or uniform, drawn from U(-1, 1) anew for every episode."""

    damage: Literal["none", "half"] = option("none", "axis", suffix=lambda value: f"damage-{value}")
    """"half": each voxel breaks with probability 0.5 at half of the episode."""

    terms: str = option(
        "ABCD",
        "variant",
        suffix=lambda value: f"without-{_left_out(value)}",
        label=lambda value: f"without {_left_out(value)}",
        controllers=_PLASTIC,
    )
    """Terms of the rules, such as "BCD" without A; those left out are zero and do not evolve."""

    terrain: str = option(
        "hilly-3-30",
        "variant",
        suffix=lambda value: f"terrain-{value}",
        label=lambda value: f"terrain {value}",
    )
    """Ground. Without a seed, every evaluation gets a terrain of its own; with one
    ("hilly-3-30-7"), all share it. Also flat, steppy-H-W, uphill-A, downhill-A."""

    sigma: float = option(
        0.35,
        "variant",
        suffix=lambda value: f"sigma-{float(value)}",
        label=lambda value: f"sigma {value}",
    )
    """Standard deviation of the mutation."""

    noise: float = option(
        0.01,
        "variant",
        suffix=lambda value: f"noise-{float(value)}",
        label=lambda value: f"noise {value}",
    )
    """Standard deviation of the sensor noise, in units of each sensor's range."""

    control_interval: int = option(
        1,
        "variant",
        suffix=lambda value: f"interval-{value}",
        label=lambda value: f"interval {value}",
    )
    """Steps of 1/60 s in a control step: the controller acts and learns once per control step."""

    generations: int = option(500, "scale")
    """Populations to evaluate."""

    population: int = option(40, "scale")
    """Individuals per generation."""

    duration: float = option(60.0, "scale")
    """Length of an episode [s]."""

    runs: int = option(1, "sample")
    """Independent runs to evolve side by side; run r is the run that --seed SEED+r alone gives."""

    seed: int = option(0, "sample")
    """Everything random follows from it."""

    device: str = option("cpu", "machine")
    """Where to compute: cpu, or cuda where PyTorch finds a GPU."""

    threads: int | None = option(None, "machine")
    """Threads of the simulator; all cores if not given. No influence on the result."""

    loop: Literal["auto", "fused", "torch"] = option("auto", "machine")
    """Control loop: network and physics in one kernel ("fused"), step by step through PyTorch
    ("torch"), or fused where it can be ("auto")."""

    def __post_init__(self) -> None:
        for name, spellings in _SPELLINGS.items():
            value = getattr(self, name)
            if isinstance(value, str) and value in spellings:
                object.__setattr__(self, name, spellings[value])

    def validate(self) -> None:
        """Check every option, and that they fit together. Nothing is written.

        Raises:
            ValueError: the first option that is wrong: its name, what was expected, what came
                and how to mend it.
        """
        for check in (self._check_choices, self._check_numbers, self._check_controller):
            check()
        self._check_world()
        self._check_device()

    def to_json(self) -> str:
        """The options as a JSON object, which `from_json` reads back."""
        return json.dumps(dataclasses.asdict(self), indent=2) + "\n"

    @classmethod
    def from_json(cls, text: str) -> EvolveConfig:
        """The options that `to_json` wrote.

        Raises:
            ValueError: the text is not JSON, or not an object with these options.
        """
        values = json.loads(text)  # a JSONDecodeError is a ValueError
        if not isinstance(values, dict):
            raise ValueError(f"config: expected a JSON object, got {type(values).__name__}")
        known = {field.name for field in dataclasses.fields(cls)}
        if unknown := sorted(values.keys() - known):
            raise ValueError(f"config: unknown option(s) {', '.join(unknown)}; remove them")
        return cls(**values)

    def _check_choices(self) -> None:
        for name, hint in get_type_hints(EvolveConfig).items():
            allowed = get_args(hint) if get_origin(hint) is Literal else None
            value = getattr(self, name)
            if allowed and value not in allowed:
                raise ValueError(f"{name}: expected one of {', '.join(allowed)}, got {value!r}")

    def _check_numbers(self) -> None:
        for name, least in (
            ("generations", 1),
            ("population", _LEAST_POPULATION),
            ("control_interval", 1),
            ("runs", 1),
            ("seed", 0),
            ("threads", 1),
        ):
            value = getattr(self, name)
            if name == "threads" and value is None:
                continue
            if not _is_integer(value) or value < least:
                raise ValueError(f"{name}: expected an integer >= {least}, got {value!r}")
        for name, minimum in (("sigma", 0.0), ("noise", 0.0), ("duration", _LEAST_DURATION)):
            value = getattr(self, name)
            if not _is_finite(value) or value < minimum:
                raise ValueError(f"{name}: expected a finite number >= {minimum}, got {value!r}")
        if self.sigma == 0:
            raise ValueError("sigma: expected a number > 0, got 0; nothing would evolve")
        if self.eta != "evolved" and not _is_finite(self.eta):
            raise ValueError(f'eta: expected a finite number or "evolved", got {self.eta!r}')

    def _check_controller(self) -> None:
        default = EvolveConfig()
        for name, what in options_of(EvolveConfig).items():
            value = getattr(self, name)
            has_it = not what.controllers or self.controller in what.controllers
            if not has_it and value != getattr(default, name):
                raise ValueError(
                    f"{name}: expected no such option with controller {self.controller}, got "
                    f"{value!r}; drop it or use controller {' or '.join(what.controllers)}"
                )
        self._check_network()

    def _check_network(self) -> None:
        """The layers know their own options and what to say of wrong ones."""
        import torch

        import hebbtorch

        network = hebbtorch.HebbianMLP(
            [1, 1],
            sharing=self.sharing,
            groups=["input"] if self.sharing == "grouped" else None,
            eta=self.eta,
            normalize=self.normalize,
            terms=self.terms,
        )
        network.initial_state(self.init, generator=torch.Generator())

    def _check_world(self) -> None:
        from physics import Apparatus, Morphology, Terrain

        apparatus = Apparatus.of(self.sensors, Morphology.from_name(self.shape))
        if apparatus.n_readings == 0:
            raise ValueError(
                f"sensors: expected at least one reading, got none from {self.sensors!r} on "
                f"{self.shape!r}; choose a richer apparatus"
            )
        Terrain.from_name(self.terrain, seed=0)

    def _check_device(self) -> None:
        from physics import checks

        try:
            checks.device(self.device)
        except RuntimeError:  # PyTorch's, for a name that it does not know
            raise ValueError(f"device: expected cpu or cuda, got {self.device!r}") from None


def _left_out(terms: str) -> str:
    """The terms of the rules that are not among these."""
    return "".join(term for term in EvolveConfig.terms if term not in terms)


def _is_integer(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_finite(value: Any) -> bool:
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return is_number and math.isfinite(value)
