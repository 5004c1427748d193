"""The published results, and what the report tells of them."""
