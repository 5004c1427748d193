"""Campaigns: declared grids of conditions x seeds, run one after another or on a cluster.

options -> grid -> study -> root -> cost -> plan -> conditions (or cluster) -> report -> command
"""
