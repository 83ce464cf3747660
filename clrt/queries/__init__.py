"""Ray queries on numpy arrays: the traversal of the renderer as a library."""
