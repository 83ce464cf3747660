"""Drivers and devices: found, probed, described, ranked and chosen."""
