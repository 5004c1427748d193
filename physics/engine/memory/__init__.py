"""Where each number lies: layout, tables of the model, state, groups of worlds."""
