"""clrt's scene files."""
