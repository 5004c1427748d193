"""Every rule, bound and schedule again, one scalar at a time, written from the definitions.

Shares no code with the package: plain floats, plain loops, no torch.
"""

import math

ACTIVATIONS = {
    "tanh": math.tanh,
    "identity": lambda v: v,
    "relu": lambda v: max(v, 0.0),
    "sigmoid": lambda v: 1 / (1 + math.exp(-v)),
}


class Layer:
    """One layer of one individual; coefficients, fixed, alpha are lists [out][in]."""

    def __init__(
        self,
        weights,
        rule,
        coefficients,
        eta,
        *,
        normalize=None,
        average=1,
        every=1,
        decay=0.0,
        clip=None,
        trace_decay=0.0,
        activation="tanh",
        bias=None,
        fixed=None,
        alpha=None,
        tau=10.0,
    ):
        self.weights = [list(row) for row in weights]
        self.n_out, self.n_in = len(weights), len(weights[0])
        self.rule, self.coefficients, self.eta = rule, coefficients, eta
        self.normalize, self.average, self.every = normalize, average, every
        self.decay, self.clip, self.trace_decay = decay, clip, trace_decay
        self.f = ACTIVATIONS[activation]
        self.bias, self.fixed, self.alpha, self.tau = bias, fixed, alpha, tau
        self.lived = 0
        self.xs, self.ys = [], []
        self.trace = [[0.0] * self.n_in for _ in range(self.n_out)]
        self.theta = [0.0] * self.n_out
        self.last = None

    def acting(self, o, i):
        if self.fixed is None:
            return self.weights[o][i]
        return self.fixed[o][i] + self.alpha[o][i] * self.weights[o][i]

    def step(self, x, plastic=True, modulation=1.0):
        y = []
        for o in range(self.n_out):
            total = sum(self.acting(o, i) * x[i] for i in range(self.n_in))
            y.append(self.f(total + (self.bias[o] if self.bias else 0.0)))
        self.lived += 1
        self.xs = [*self.xs, list(x)][-self.average :]
        self.ys = [*self.ys, list(y)][-self.average :]
        pre = [sum(column) / len(self.xs) for column in zip(*self.xs, strict=True)]
        post = [sum(column) / len(self.ys) for column in zip(*self.ys, strict=True)]
        due = self.lived % self.every == 0
        for o in range(self.n_out):
            for i in range(self.n_in):
                dw = self.eta[o][i] * self.change(o, i, pre[i], post[o])
                if due:
                    self.trace[o][i] = self.trace_decay * self.trace[o][i] + dw
                    if plastic:
                        w = (1 - self.decay) * self.weights[o][i]
                        self.weights[o][i] = w + modulation * self.trace[o][i]
        self.theta = [t + (v * v - t) / self.tau for t, v in zip(self.theta, post, strict=True)]
        self.last = pre, post
        if due and plastic:
            self.bound()
        return y

    def change(self, o, i, x, y):
        w = self.weights[o][i]
        c = {name: values[o][i] for name, values in self.coefficients.items()}
        if self.rule == "abcd":
            return c["A"] * x * y + c["B"] * x + c["C"] * y + c["D"]
        if self.rule == "hebb":
            return c["c"] * x * y
        if self.rule == "oja":
            return c["c"] * (x * y - y**2 * w)
        if self.rule == "bcm":
            return c["c"] * x * y * (y - self.theta[o])
        if self.last is None:  # "differential"
            return 0.0
        return c["c"] * (x - self.last[0][i]) * (y - self.last[1][o])

    def bound(self):
        rows = self.weights
        if self.clip is not None:
            rows[:] = [[min(max(w, -self.clip), self.clip) for w in row] for row in rows]
        if self.normalize == "max":
            greatest = max(abs(w) for row in rows for w in row)
            if greatest > 0:
                rows[:] = [[w / greatest for w in row] for row in rows]
        for row in rows:
            norm, low, high = math.sqrt(sum(w * w for w in row)), min(row), max(row)
            if self.normalize == "l2" and norm > 0:
                row[:] = [w / norm for w in row]
            if self.normalize == "minmax" and high > low:
                row[:] = [2 * (w - low) / (high - low) - 1 for w in row]
