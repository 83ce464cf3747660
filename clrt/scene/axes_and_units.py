"""Axes and units that files may have."""

from __future__ import annotations

from typing import Literal

Axis = Literal["x", "y", "z"]
Unit = Literal["m", "cm", "mm", "in", "ft"]
METERS: dict[Unit, float] = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
LightUnit = Literal["photometric", "radiometric", "blender"]
