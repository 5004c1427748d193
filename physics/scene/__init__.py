"""What is simulated, as plain data: shape, material, sensors, ground, damage, time."""
