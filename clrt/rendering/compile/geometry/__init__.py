"""Geometry packed for the device."""
