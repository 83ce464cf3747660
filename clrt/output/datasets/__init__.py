"""Datasets of views in the formats that other programs read."""
