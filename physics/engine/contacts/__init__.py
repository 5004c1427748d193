"""What keeps squares out of the ground and of each other: detection and solvers."""
