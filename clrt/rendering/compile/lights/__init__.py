"""Lights packed for the device, and the distributions that light sampling uses."""
