"""Intersection tests, samplers, densities and sums against float64 references and closed forms."""
