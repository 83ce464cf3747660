"""What the code generators of GPU vendors make of the kernels, on a machine without a GPU."""
