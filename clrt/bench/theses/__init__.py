"""The experiments of two theses."""
