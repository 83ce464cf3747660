"""Baking: light and ambient occlusion of a mesh into an image over its texture coordinates."""
