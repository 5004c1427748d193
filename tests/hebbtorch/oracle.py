"""The networks of the paper again, one scalar at a time, from the paper and the gene order.

Shares no code with the package: plain floats, plain loops, no torch.
"""

import math


def genes_of(sharing, sizes, groups, evolved):
    """List of (layer, name, row, column) in the order of the genome."""
    names = ["A", "B", "C", "D"] + ["eta"] * evolved
    genes = []
    for layer in range(len(sizes) - 1):
        n_in, n_out = sizes[layer], sizes[layer + 1]
        if sharing == "single" and layer > 0:
            break
        rows = n_out if sharing in ("full", "presynaptic") else 1
        columns = n_in if sharing in ("full", "postsynaptic") else 1
        if sharing == "grouped" and layer == 0:
            columns = len(set(groups))
        for name in names:
            for row in range(rows):
                for column in range(columns):
                    genes.append((layer, name, row, column))
    return genes


def rule_of(sharing, groups, layer, o, i):
    """(layer, row, column) of the rule of the synapse i -> o of a layer."""
    if sharing == "full":
        return layer, o, i
    if sharing == "presynaptic":
        return layer, o, 0
    if sharing == "postsynaptic":
        return layer, 0, i
    if sharing == "single":
        return 0, 0, 0
    if layer > 0:
        return layer, 0, 0
    first_seen = []
    for label in groups:
        if label not in first_seen:
            first_seen.append(label)
    return layer, 0, first_seen.index(groups[i])


def live(genome, sizes, weights, inputs, *, sharing="full", groups=None, eta=0.01, normalize=None):
    """Outputs of each step and the weights [layer][o][i] after the last one."""
    evolved = eta == "evolved"
    value = dict(zip(genes_of(sharing, sizes, groups, evolved), genome, strict=True))
    weights = [[list(row) for row in layer] for layer in weights]
    outputs = []
    for x in inputs:
        activations = [list(x)]
        for layer in weights:
            pre = activations[-1]
            activations.append(
                [math.tanh(sum(w * p for w, p in zip(row, pre, strict=True))) for row in layer]
            )
        outputs.append(activations[-1])
        for k, layer in enumerate(weights):
            for o, row in enumerate(layer):
                for i in range(len(row)):
                    at, r, c = rule_of(sharing, groups, k, o, i)
                    rate = 0.01 * 10.0 ** value[at, "eta", r, c] if evolved else eta
                    pre, post = activations[k][i], activations[k + 1][o]
                    row[i] += rate * (
                        value[at, "A", r, c] * pre * post
                        + value[at, "B", r, c] * pre
                        + value[at, "C", r, c] * post
                        + value[at, "D", r, c]
                    )
                if normalize == "l2":
                    norm = math.sqrt(sum(w * w for w in row))
                    if norm > 0:
                        row[:] = [w / norm for w in row]
                elif normalize == "minmax":
                    low, span = min(row), max(row) - min(row)
                    if span > 0:
                        row[:] = [2 * (w - low) / span - 1 for w in row]
    return outputs, weights
