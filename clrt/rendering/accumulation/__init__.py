"""Samples accumulated on one device or several."""
