"""Pure functions on plain tensors: learning rules, bounds on weights, activations."""
