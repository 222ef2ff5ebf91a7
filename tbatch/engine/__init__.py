"""Many runs at once: the batch kernels and what launches them."""
