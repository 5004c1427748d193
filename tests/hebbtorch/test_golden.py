"""The paper's own controllers, recorded step by step.

They differ from the paper's text, and so from the package, in three ways, all undone here:
B weighs the post- and C the pre-synaptic activation; genes run input by input, A B C D
interleaved; the last input is overwritten by 1.
"""

import json

import pytest
import torch

import hebbtorch
from tests.reference import GOLDEN_NETWORKS

GOLDEN = json.loads(GOLDEN_NETWORKS.read_text(encoding="utf-8"))
OUR_NAME = {"A": 0, "B": 2, "C": 1, "D": 3}  # our name -> their column


def network(case, sharing):
    net = hebbtorch.HebbianMLP(case["sizes"], sharing=sharing, eta=case["eta"], dtype=torch.float64)
    theirs = torch.tensor(case["coefs"], dtype=torch.float64).reshape(-1, 4)
    genome = torch.empty(net.n_genes, dtype=torch.float64)
    per_layer = [block.shape[0] * block.shape[1] for block in net.gene_blocks[::4]]
    layers = theirs.split(per_layer)
    for block in net.gene_blocks:
        rows, columns = block.shape
        values = layers[block.layer][:, OUR_NAME[block.name]]
        genome[block.genes] = values.reshape(columns, rows).T.reshape(-1)  # theirs: input by input
    net.set_genomes(genome)
    return net


@pytest.mark.parametrize(
    ("name", "sharing"), [("full_5-5-3", "full"), ("output_5-5-3", "presynaptic")]
)
def test_recorded_network(name, sharing):
    case = GOLDEN[name]
    net = network(case, sharing)
    inputs = torch.tensor(case["inputs"], dtype=torch.float64)
    inputs[:, -1] = 1.0
    state = net.initial_state()
    weights_checked = 0
    for step, (x, expected) in enumerate(zip(inputs, case["outputs"], strict=True), start=1):
        y, state = net(x, state)
        torch.testing.assert_close(y.tolist(), expected, rtol=0, atol=1e-12)
        if f"after_{step}" in case["weights"]:
            theirs = case["weights"][f"after_{step}"]
            ours = torch.cat([w.mT.reshape(-1) for w in state.weights]).tolist()
            torch.testing.assert_close(ours, theirs, rtol=0, atol=1e-12)
            weights_checked += 1
    assert (step, weights_checked) == (50, 3)
