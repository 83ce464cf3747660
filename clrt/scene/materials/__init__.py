"""Materials as plain data, with their textures and energy tables."""
