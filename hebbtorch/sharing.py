"""Which synapses share a rule (paper, Sec. IV-D).

| sharing        | one rule per                                     | rules of a layer |
|----------------|--------------------------------------------------|------------------|
| "full"         | synapse                                          | out x in         |
| "presynaptic"  | neuron, shared by its incoming synapses          | out x 1          |
| "postsynaptic" | neuron, shared by its outgoing synapses          | 1 x in           |
| "grouped"      | label, shared by the synapses leaving its inputs | 1 x labels       |
| "single"       | network                                          | 1 x 1            |
| "neuron"       | synapse, made from genes of its two neurons      | see below        |

The names are the paper's: its *pre-synaptic* model shares a rule among the pre-synaptic
connections of a neuron. "grouped" is its *sensors* model; there, layers after the first have
one rule each.

"neuron" is neuron-centric Hebbian learning (Ferigo, Cunegatti, Iacca, arXiv 2403.12076): not
synapses but neurons have genes, and a network of N neurons has 5 N - n_in - n_out of them with an
evolved learning rate, 4 N - n_in - n_out with a fixed one. See `hebbtorch.neuron_rules`.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

from torch import Tensor

SHARINGS = ("full", "single", "presynaptic", "postsynaptic", "grouped", "neuron")


@dataclass(frozen=True)
class RuleGrid:
    """The distinct rules of one layer, as a grid that broadcasts to (out, in).

    Attributes:
        rows: `out`, or 1 where all outputs share.
        columns: `in`, 1 where all inputs share, or the number of labels.
        column_of_input: The column that each input uses with "grouped"; None with other sharings.
    """

    rows: int
    columns: int
    column_of_input: tuple[int, ...] | None = None


def rule_grid(
    sharing: str, n_in: int, n_out: int, groups: Sequence[Hashable] | None = None
) -> RuleGrid:
    """The grid of rules of a layer of `n_in` -> `n_out` neurons.

    Args:
        sharing: one of `SHARINGS`.
        n_in: number of pre-synaptic neurons.
        n_out: number of post-synaptic neurons.
        groups: One label per input, for "grouped" only. Labels get their column in the order in
            which they first appear.

    Raises:
        ValueError: unknown sharing, or groups missing, superfluous or of the wrong length, or
            "neuron", which has no grid.
    """
    if sharing not in SHARINGS:
        raise ValueError(f"sharing: expected one of {SHARINGS}, got {sharing!r}")
    if (groups is not None) != (sharing == "grouped"):
        raise ValueError(
            f"groups: expected one label per input with sharing='grouped' and None otherwise, "
            f"got {groups!r} with sharing={sharing!r}"
        )
    if groups is not None:
        if any(isinstance(label, Tensor) for label in groups):
            raise ValueError(
                "groups: expected labels that compare by value, such as str or int, got tensors; "
                "pass groups.tolist()"
            )
        if len(groups) != n_in:
            raise ValueError(f"groups: expected {n_in} labels, one per input, got {len(groups)}")
        column = {label: k for k, label in enumerate(dict.fromkeys(groups))}
        return RuleGrid(1, len(column), tuple(column[label] for label in groups))
    if sharing == "neuron":
        raise ValueError("sharing: expected one with a grid of rules, got 'neuron'")
    rows = n_out if sharing in ("full", "presynaptic") else 1
    columns = n_in if sharing in ("full", "postsynaptic") else 1
    return RuleGrid(rows, columns)
