"""Experiments that anyone can repeat: what is claimed of speed and error is measured here."""
