"""Axes and units that files may have."""

from __future__ import annotations

from typing import Literal

Axis = Literal["x", "y", "z"]
Unit = Literal["m", "cm", "mm", "in", "ft"]
METERS: dict[Unit, float] = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
LightUnit = Literal["photometric", "radiometric", "blender"]
#: What is said of lights that were converted from a unit that was guessed.
CONVERTED: dict[LightUnit, str] = {
    "photometric": "the lights are taken as candela and lux, and divided by 683 lm/W",
    "blender": "the lights are taken as watts, which versions of Blender before 3.6 write",
}
