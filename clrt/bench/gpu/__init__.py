"""A device measured from end to end: correctness, speed of every variant, builds, frames and compile times."""
