"""Reproducible experiments that measure the speed and accuracy claimed for clrt."""
