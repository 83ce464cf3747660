"""Rays per second, tree builds, and other ray libraries."""
