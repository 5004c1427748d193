"""What an evolution is: every option of a run, checked before anything is written.

This module imports neither torch nor the simulator at the top, so that the command line can
show its help at once.
"""

from __future__ import annotations

import dataclasses
import json
import math
from dataclasses import dataclass
from typing import Any, Literal

from experiments.config.options import (
    PLASTIC,
    STATIC,
    noise_option,
    option,
    plastic_option,
    world_option,
)
from experiments.io.formats import require_format

__all__ = ["EvolveConfig"]

_FORMAT = 1  # of the options in JSON
_SENSORS = "area", "touch", "velocity", "lidar"
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

    shape: str = option("biped-4x3", "axis", group="robot")
    """Robot: biped-WxH, worm-WxH, box-WxH, tripod-WxH, comb-WxH, T-WxH or ball-D."""

    sensors: str = option("low", "axis", group="robot")
    """Sensory apparatus: low, medium or high."""

    controller: Literal["hebbian", "mlp", "rnn"] = option("hebbian", "axis", group="controller")
    """Plastic network whose rules evolve, or static network whose weights evolve: feed-forward, or
    recurrent with at most as many genes as the plastic one has ("rnn", Elman's)."""

    sharing: str = option(
        "full",
        "variant",
        group="controller",
        label={
            "grouped": "sensors",
            "presynaptic": "pre-synaptic",
            "postsynaptic": "post-synaptic",
            "neuron": "neuron-centric",
        },
        controllers=PLASTIC,
    )
    """Which synapses share a rule: full (none do), single (all do), presynaptic (those that enter
    a neuron), postsynaptic (those that leave it), grouped (those of one kind of sensor) or neuron
    (genes belong to neurons, and a synapse combines those of its two)."""

    rule: str = plastic_option("abcd")
    """Learning rule: abcd (the paper's), hebb, oja, bcm or differential."""

    normalize: str | None = plastic_option(
        None,
        suffix=lambda value: "normalized" if value == "l2" else f"normalized-{value}",
        label={"l2": "normalized", "minmax": "min-max", "max": "over the greatest"},
    )
    """none: weights as the rules leave them; l2: every neuron's incoming weights scaled to norm 1
    (the paper's text); minmax: mapped onto [-1, 1] (the paper's code); max: every layer's over the
    greatest of them."""

    average: int = plastic_option(1, suffix="average-{}", label="means over {} steps", least=1)
    """The rule sees the means of the activations over so many control steps."""

    every: int = plastic_option(1, suffix="every-{}", label="updates every {} steps", least=1)
    """The weights change once in so many control steps."""

    decay: float = plastic_option(0.0, suffix="decay-{:g}", label="decay {:g}", least=0.0)
    """Share of the weights that is lost in each update."""

    clip: float = plastic_option(0.0, suffix="clip-{:g}", label="clipped at {:g}", least=0.0)
    """Bound on the magnitude of the weights; 0: none."""

    eta: float | Literal["evolved"] = plastic_option(
        0.01,
        suffix="eta-{}",
        label=lambda value: "η evolved" if value == "evolved" else f"η = {value}",
    )
    """Learning rate, or "evolved" for one gene per rule."""

    init: str = plastic_option("zeros", suffix="init-{}", label={"uniform": "U(-1, 1)"})
    """Initial weights: zeros; uniform U(-1, 1), normal N(0, 1) or kaiming N(0, 2 / inputs), drawn
    anew for every episode; or evolved, genes of their own."""

    fixed: bool = plastic_option(False, suffix="fixed", label="fixed and plastic")
    """Weights that are not plastic are added: fixed + alpha * plastic, fixed and alpha evolve."""

    damage: Literal["none", "half"] = option("none", "axis", group="robot", suffix="damage-{}")
    """"half": each voxel breaks with probability 0.5 at half of the episode."""

    exchange_bc: bool = plastic_option(False, suffix="bc-exchanged", label="B and C exchanged")
    """B weighs the post- and C the pre-synaptic activation, as in the paper's code."""

    constant_last_input: bool = option(
        False,
        "variant",
        group="controller",
        suffix="constant-input",
        label="last input constant",
        controllers=PLASTIC,
    )
    """The last reading is replaced by 1, a bias of the hidden neurons, as in the paper's code."""

    gain: float = option(
        1.0,
        "variant",
        group="controller",
        suffix="gain-{:g}",
        label="gain {:g}",
        controllers=STATIC,
    )
    """Of a static network: the factor on every gene where it becomes a weight."""

    bias: bool = option(False, "variant", group="controller", suffix="bias", label="biases")
    """Every neuron but the inputs has a bias, a gene of its own, which is not plastic."""

    input_activation: Literal["identity", "tanh"] = option(
        "identity",
        "variant",
        group="controller",
        suffix="inputs-{}",
        label="{} on inputs",
        controllers=STATIC,
    )
    """Of a static network, applied to the readings; the paper's code has tanh."""

    terms: str = plastic_option(
        "ABCD",
        suffix=lambda value: f"without-{_left_out(value)}",
        label=lambda value: f"without {_left_out(value)}",
    )
    """Terms of the rules, such as "BCD" without A; those left out are zero and do not evolve."""

    terrain: str = world_option("hilly-3-30", suffix="terrain-{}", label="terrain {}")
    """Ground. Without a seed, every evaluation gets a terrain of its own; with one
    ("hilly-3-30-7"), all share it. Also flat, steppy-H-W, uphill-A, downhill-A."""

    optimizer: Literal["es", "cma", "sep-cma"] = option(
        "es", "variant", group="evolution", label=lambda v: v.upper()
    )
    """Evolution strategy: es (the paper's Algorithm 1), or pycma's CMA-ES with a full covariance
    matrix (cma) or its diagonal (sep-cma), which start around zero with step size --sigma."""

    sigma: float = option(
        0.35,
        "variant",
        group="evolution",
        suffix=lambda value: f"sigma-{float(value)}",
        label="sigma {}",
        least=0.0,
    )
    """Standard deviation of the mutation."""

    noise: float = option(
        0.01,
        "variant",
        group="robot",
        suffix=lambda value: f"noise-{float(value)}",
        label="noise {}",
        least=0.0,
    )
    """Standard deviation of the sensor noise, in units of each sensor's range."""

    noise_area: float | None = noise_option("area")
    """The same of area sensors alone; --noise if not given."""

    noise_touch: float | None = noise_option("touch")
    """The same of touch sensors alone; --noise if not given."""

    noise_velocity: float | None = noise_option("velocity")
    """The same of velocity sensors alone; --noise if not given."""

    noise_lidar: float | None = noise_option("lidar")
    """The same of lidar sensors alone; --noise if not given."""

    control_interval: int = option(
        1,
        "variant",
        group="controller",
        suffix="interval-{}",
        label="every {} steps",
        least=1,
    )
    """Steps of 1/60 s in a control step: the controller acts and learns once per control step."""

    control_delay: int = option(
        0,
        "variant",
        group="controller",
        suffix="delay-{}",
        label="delay of {} steps",
        least=0,
    )
    """Control steps that a command waits before it acts."""

    actuation_cutoff: float | None = option(
        None,
        "variant",
        group="controller",
        suffix="cutoff-{}",
        label="cut-off {} Hz",
        least=0.0,
    )
    """Cut-off frequency [Hz] of a low-pass between controller and actuation; none if not given."""

    gravity: float = world_option(9.8, suffix="gravity-{}", label="gravity {}", least=-math.inf)
    """Downward acceleration [m/s^2]."""

    friction: float | None = world_option(
        None, suffix="friction-{}", label="friction {}", least=0.0
    )
    """Coefficient of friction with the ground; the engine's (1.414) if not given."""

    spring_frequency: float = world_option(
        8.0, suffix="springs-{}", label="springs of {} Hz", least=0.1
    )
    """Frequency of the voxels' springs [Hz]."""

    spring_damping: float = world_option(0.3, suffix="damping-{}", label="damping {}", least=0.0)
    """Damping ratio of the voxels' springs."""

    damage_mode: Literal["rest", "frozen", "random", "blind"] = option(
        "rest", "variant", group="robot"
    )
    """What broken voxels do: rest (the paper's text), frozen, random, or obey without sensing
    (blind)."""

    damage_probability: float = option(
        0.5,
        "variant",
        group="robot",
        suffix="broken-{}",
        label="{} of the voxels",
        least=0.0,
    )
    """Probability of each voxel to break."""

    damage_time: float | None = option(
        None,
        "variant",
        group="robot",
        suffix=lambda value: f"broken-at-{float(value)}",
        label="damage at {} s",
        least=0.0,
    )
    """When voxels break [s]; at half of the episode if not given."""

    damage_until: float | None = option(
        None,
        "variant",
        group="robot",
        suffix=lambda value: f"mended-at-{float(value)}",
        label="mended at {} s",
        least=0.0,
    )
    """When broken voxels work again [s]; never if not given."""

    damage_voxels: str = option(
        "",
        "variant",
        group="robot",
        suffix=lambda value: f"broken-voxels-{value.replace(',', '-')}",
        label="voxels {} break",
    )
    """Numbers of the voxels that break, such as "0,3", counted from the bottom row; by chance
    if not given."""

    generations: int = option(500, "scale", group="evolution", least=1)
    """Populations to evaluate."""

    population: int = option(40, "scale", group="evolution", least=4)
    """Individuals per generation."""

    duration: float = option(60.0, "scale", group="world", least=0.1)
    """Length of an episode [s]."""

    runs: int = option(1, "sample", group="evolution", least=1)
    """Independent runs to evolve side by side; run r is the run that --seed SEED+r alone gives."""

    seed: int = option(0, "sample", group="evolution", least=0)
    """Everything random follows from it."""

    device: str = option("cpu", "machine", group="computation")
    """Where to compute: cpu, or cuda where PyTorch finds a GPU."""

    threads: int | None = option(None, "machine", group="computation", least=1)
    """Threads of the simulator; all cores if not given. No influence on the result."""

    loop: Literal["auto", "fused", "torch"] = option("auto", "machine", group="computation")
    """Control loop: network and physics in one kernel ("fused"), step by step through PyTorch
    ("torch"), or fused where it can be ("auto")."""

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):  # numbers of NumPy and PyTorch become Python's
            value = getattr(self, field.name)
            if getattr(value, "ndim", None) == 0 and hasattr(value, "item"):
                object.__setattr__(self, field.name, value.item())
        for name, spellings in _SPELLINGS.items():
            value = getattr(self, name)
            if isinstance(value, str) and value in spellings:
                object.__setattr__(self, name, spellings[value])

    def validate(self, *, machine: bool = True) -> None:
        """Check every option, and that they fit together. Nothing is written.

        Args:
            machine: whether to check, too, that this machine has the device and the memory; what
                was computed elsewhere can be read without them.

        Raises:
            ValueError: the first option that is wrong: its name, what was expected, what came
                and how to mend it.
        """
        from experiments.config.checks import check

        check(self, machine=machine)

    def plastic_options(self) -> dict[str, Any]:
        """The options of plastic networks as `hebbtorch.HebbianMLP` takes them."""
        names = (
            "rule", "sharing", "normalize", "average", "every", "decay", "eta", "init",
            "fixed", "bias", "exchange_bc", "constant_last_input", "terms",
        )  # fmt: skip
        return {"clip": self.clip or None, **{name: getattr(self, name) for name in names}}

    def noises(self) -> float | dict[str, float]:
        """The sensor noise as `physics.Simulator` takes it."""
        own = {kind: getattr(self, f"noise_{kind}") for kind in _SENSORS}
        if all(value is None for value in own.values()):
            return self.noise
        return {kind: self.noise if value is None else value for kind, value in own.items()}

    def voxels_that_break(self) -> list[int]:
        """The numbers in `damage_voxels`.

        Raises:
            ValueError: they are no numbers.
        """
        words = self.damage_voxels.split(",") if self.damage_voxels else []
        if not all(word.strip().isdecimal() for word in words):
            raise ValueError(
                'damage_voxels: expected numbers of voxels such as "0,3", got '
                f"{self.damage_voxels!r}"
            )
        return [int(word) for word in words]

    def to_json(self) -> str:
        """The options as a JSON object, which `from_json` reads back."""
        return json.dumps({"format": _FORMAT, **dataclasses.asdict(self)}, indent=2) + "\n"

    @classmethod
    def from_json(cls, text: str) -> EvolveConfig:
        """The options that `to_json` wrote.

        Raises:
            ValueError: the text is not JSON, not an object with these options, or in a newer
                format.
        """
        try:
            values = json.loads(text)  # a JSONDecodeError is a ValueError
        except RecursionError:
            raise ValueError("config: expected a JSON object, got nothing but brackets") from None
        if not isinstance(values, dict):
            raise ValueError(f"config: expected a JSON object, got {type(values).__name__}")
        require_format(values.pop("format", _FORMAT), _FORMAT)  # earlier versions wrote none
        known = {field.name for field in dataclasses.fields(cls)}
        if unknown := sorted(values.keys() - known):
            raise ValueError(f"config: unknown option(s) {', '.join(unknown)}; remove them")
        return cls(**values)


def _left_out(terms: str) -> str:
    """The terms of the rules that are not among these."""
    return "".join(term for term in EvolveConfig.terms if term not in terms)
