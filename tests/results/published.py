"""Reads the published results. Nothing of this project computes here: only csv, numpy and scipy."""

import csv
import io
import math
import re
import zipfile
from collections import defaultdict
from pathlib import Path

import numpy as np

RESULTS = Path(__file__).parents[2] / "experiments" / "results"


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


CONTROLS, FULL = RESULTS / "controls", RESULTS / "full-scale"
ACTS = {"every step": "", "every 2nd": "-interval-2", "every 4th": "-interval-4"}
ACTS["every 12th"] = "-interval-12"
NETWORKS = {
    "Hebbian": "hebbian",
    "MLP": "mlp",
    "MLP, gain 10": "mlp-gain-10",
    "MLP, gain 30": "mlp-gain-30",
    "MLP, gain 30, biases": "mlp-gain-30-bias",
    "recurrent, gain 30": "rnn-gain-30",
    "Hebbian, as in their code": "hebbian-bc-exchanged-constant-input",
    "MLP, as in their code": "mlp-bias-inputs-tanh",
}


def condition(where: str, network: str, *, damage: bool = False) -> str:
    """A condition's name, of "biped low" and the name of a network in the report."""
    body, sensors = where.split()
    shape = {"biped": "biped-4x3", "worm": "worm-7x1"}[body]
    return f"{shape}-{sensors}-{NETWORKS[network]}" + ("-damage-half" if damage else "")


def report_rows(heading: str) -> list[list[str]]:
    """The cells of the first table under a heading of the report, without its head."""
    text = (RESULTS / "REPORT.md").read_text(encoding="utf-8")
    _, section = re.split(rf"\n#+ {re.escape(heading)}.*\n", text)
    _, table = re.split(r"\n\|[-|]+\|\n", section, maxsplit=1)
    lines = re.split(r"\n\n", table)[0].splitlines()
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


class Published:
    """What the report tells of the conditions of a packed campaign, by scipy and numpy alone."""

    def __init__(self, bundle: Path) -> None:
        self.runs = defaultdict(list)
        for row in rows(bundle / "runs.csv"):
            self.runs[row["condition"]].append((float(row["speed"]), float(row["unseen"])))
        with zipfile.ZipFile(bundle / "tables.zip") as archive:
            self.takeoff = {name: takeoffs(archive, name) for name in self.runs}
            self.hertz = {
                name: per_run(archive, f"{name}/gaits.csv", "gait_frequency") for name in self.runs
            }

    def cells(self, name: str) -> list[str]:
        """Final speed, that on 40 terrains, generation of the take-off, frequency."""
        speeds, unseen = np.array(self.runs[name]).T
        assert len(speeds) == 10
        low, middle, high = (f"{f(speeds):.1f}" for f in (np.min, np.median, np.max))
        half = sorted(self.takeoff[name])[4]  # the fifth of ten runs
        ever = sum(map(math.isfinite, self.takeoff[name]))
        hertz = self.hertz[name]
        return [
            f"{middle} ({low} to {high})",
            f"{np.median(unseen):.1f}",
            f"{half:g}" if math.isfinite(half) else f"{ever} of 10 ever",
            (f"{np.median(hertz):.1f}" if len(hertz) else "none")
            + (f" ({len(hertz)})" if 0 < len(hertz) < 10 else ""),
        ]


def takeoffs(archive: zipfile.ZipFile, name: str) -> list[float]:
    """The generation in which each run was above 1 m/s for the first time."""
    first: dict[str, float] = {}
    for row in csv.DictReader(io.StringIO(archive.read(f"{name}/history.csv").decode())):
        first.setdefault(row["run"], math.inf)
        if float(row["best"]) > 1:
            first[row["run"]] = min(first[row["run"]], int(row["generation"]))
    return list(first.values())


def per_run(archive: zipfile.ZipFile, name: str, column: str) -> list[float]:
    """Median over the terrains of each run that has such a number on at least half of them."""
    of_run = defaultdict(list)
    for row in csv.DictReader(io.StringIO(archive.read(name).decode())):
        of_run[row["run"]].append(float(row[column]))
    known = [(own, [each for each in own if math.isfinite(each)]) for own in of_run.values()]
    return [float(np.median(each)) for own, each in known if 2 * len(each) >= len(own)]
