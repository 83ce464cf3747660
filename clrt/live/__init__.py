"""Rendering of a scene while it is edited: everything that an interactive window needs except the window."""
