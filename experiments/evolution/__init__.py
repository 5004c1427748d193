"""The loop that evolves genomes."""
