"""Output: image files, view transforms, comparison, reports."""
