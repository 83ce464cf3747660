"""Path guiding: a field of directional distributions, learned from paths before the image is rendered."""
