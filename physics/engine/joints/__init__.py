"""What holds a robot together: springs, ropes, welds."""
