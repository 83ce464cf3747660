"""Trees over primitives: builders, wide layouts, statistics."""
