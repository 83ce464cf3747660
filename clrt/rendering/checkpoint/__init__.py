"""Checkpoints: the saved state of a render, its identity, its file."""
