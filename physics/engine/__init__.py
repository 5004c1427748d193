"""How one step is computed: the kernels and their stages."""
