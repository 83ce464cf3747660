"""USD, read by usd-core."""
