"""Distributed rendering: images rendered by the workers of a Dask cluster (docs/farm.md)."""
