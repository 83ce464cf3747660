"""pbrt's scenes."""
