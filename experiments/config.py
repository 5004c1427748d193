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

__all__ = ["EvolveConfig"]

_LEAST_DURATION = 0.1  # [s]
_LEAST_POPULATION = 4  # of which a quarter are parents
_PLASTIC_OPTIONS = (
    "sharing",
    "normalize",
    "eta",
    "init",
    "terms",
    "exchange_bc",
    "constant_last_input",
)
_STATIC_OPTIONS = ("gain", "bias", "input_activation")


@dataclass(frozen=True)
class EvolveConfig:
    """Everything that decides the outcome of an evolution; the defaults are the paper's."""

    shape: str = "biped-4x3"
    """Robot: biped-WxH, worm-WxH, box-WxH, tripod-WxH, comb-WxH, T-WxH or ball-D."""

    sensors: Literal["low", "medium", "high"] = "low"
    """Sensory apparatus."""

    controller: Literal["hebbian", "mlp", "rnn"] = "hebbian"
    """Plastic network whose rules evolve, or static network whose weights evolve: feed-forward, or
    recurrent with at most as many genes as the plastic one has ("rnn", Elman's)."""

    sharing: Literal["full", "single", "presynaptic", "postsynaptic", "grouped"] = "full"
    """Which synapses share a rule; "grouped" is one rule per kind of sensor."""

    normalize: Literal["none", "l2", "minmax"] = "none"
    """Weights as the rules leave them, or every neuron's incoming weights scaled to norm 1 ("l2",
    the paper's text), or mapped onto [-1, 1] ("minmax", the paper's code)."""

    eta: float | Literal["evolved"] = 0.01
    """Learning rate, or "evolved" for one gene per rule."""

    init: Literal["zero", "uniform"] = "zero"
    """Weights at birth: zero, or drawn from U(-1, 1) anew for every life."""

    terms: str = "ABCD"
    """Terms of the rules, such as "BCD" without A; those left out are zero and do not evolve."""

    exchange_bc: bool = False
    """B weighs the post- and C the pre-synaptic activation, as in the paper's code."""

    constant_last_input: bool = False
    """The last reading is replaced by 1, a bias of the hidden neurons, as in the paper's code."""

    gain: float = 1.0
    """Of a static network: the factor on every gene where it becomes a weight."""

    bias: bool = False
    """Of a static network: every neuron but the inputs has a bias, a gene of its own."""

    input_activation: Literal["identity", "tanh"] = "identity"
    """Of a static network, applied to the readings; the paper's code has tanh."""

    terrain: str = "hilly-3-30"
    """Ground. Without a seed, every evaluation gets a terrain of its own; with one
    ("hilly-3-30-7"), all share it. Also flat, steppy-H-W, uphill-A, downhill-A."""

    damage: Literal["none", "half"] = "none"
    """"half": each voxel breaks with probability 0.5 at half of the life."""

    generations: int = 500
    """Populations to evaluate."""

    population: int = 40
    """Individuals per generation."""

    sigma: float = 0.35
    """Standard deviation of the mutation."""

    duration: float = 60.0
    """Length of a life [s]."""

    noise: float = 0.01
    """Standard deviation of the sensor noise, in units of each sensor's range."""

    control_interval: int = 1
    """Steps of 1/60 s in a control step: the controller acts and learns once per control step."""

    runs: int = 1
    """Independent runs to evolve side by side; run r is the run that --seed SEED+r alone gives."""

    seed: int = 0
    """Everything random follows from it."""

    device: str = "cpu"
    """Where to compute: cpu, or cuda where PyTorch finds a GPU."""

    threads: int | None = None
    """Threads of the simulator; all cores if not given. No influence on the result."""

    loop: Literal["auto", "fused", "torch"] = "auto"
    """Control loop: network and physics in one kernel ("fused"), step by step through PyTorch
    ("torch"), or fused where it can be ("auto")."""

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
        if not _is_finite(self.gain) or self.gain == 0:
            raise ValueError(f"gain: expected a finite number other than 0, got {self.gain!r}")
        if self.eta != "evolved" and not _is_finite(self.eta):
            raise ValueError(f'eta: expected a finite number or "evolved", got {self.eta!r}')

    def _check_controller(self) -> None:
        from hebbtorch.rule_bank import check_terms

        check_terms(self.terms)
        is_plastic = self.controller == "hebbian"
        default = EvolveConfig()
        for name in _STATIC_OPTIONS if is_plastic else _PLASTIC_OPTIONS:
            if getattr(self, name) != getattr(default, name):
                lacking, other = (
                    ("whose weights do not evolve", "mlp or rnn")
                    if is_plastic
                    else ("which has no plasticity", "hebbian")
                )
                raise ValueError(
                    f"{name}: expected no such option with controller {self.controller}, {lacking},"
                    f" got {getattr(self, name)!r}; drop it or use controller {other}"
                )

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


def _is_integer(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_finite(value: Any) -> bool:
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return is_number and math.isfinite(value)
