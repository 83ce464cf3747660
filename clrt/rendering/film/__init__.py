"""The film on the host: means, variances and counts per pixel."""
