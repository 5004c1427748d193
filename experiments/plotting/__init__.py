"""How all figures look, whoever draws them."""
