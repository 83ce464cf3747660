"""3MF, read by lib3mf."""
