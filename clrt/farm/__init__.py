"""Many machines, one picture: renders on the workers of a Dask cluster (docs/farm.md)."""
