"""Programs: composed from kernel files, compiled in the background, cached."""
