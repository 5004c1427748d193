"""One episode, from options and genomes to what is measured of it."""
