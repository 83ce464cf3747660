"""Experiments that anyone can run again: what is claimed of speed and error is measured here."""
