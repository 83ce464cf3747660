"""Readers and writers of scene, model and image files."""
