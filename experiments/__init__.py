"""Experiments that join the plastic networks of `hebbtorch` with the soft robots of `physics`."""
