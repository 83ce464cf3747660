"""PLY model files (G. Turk, "The PLY Polygon File Format", 1994)."""
