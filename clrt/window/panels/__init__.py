"""Panels next to the viewport, one per file, drawn anew in every frame."""
