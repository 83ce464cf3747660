"""Device checks against known results: whether the driver compiles and runs the kernels correctly."""
