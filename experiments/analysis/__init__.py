"""What is measured of champions."""
