"""Analytic daylight: the sun's position, and the radiance of the sky and the sun by Hosek and Wilkie."""
