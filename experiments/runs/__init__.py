"""What a run leaves on disk: options, checkpoint, course, champions, TensorBoard files."""
