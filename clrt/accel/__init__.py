"""BVHs over primitives: builders, wide layouts, statistics."""
