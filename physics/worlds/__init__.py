"""A batch of worlds in memory: what it starts from, how it is launched, saved and observed."""
