"""Mitsuba 3's XML scenes."""
