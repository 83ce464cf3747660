"""Units of the lights of a glTF file.

The specification (KHR_lights_punctual) says candela and lux. Many programs write W/sr and W/m², or numbers without a
unit, that are right if a renderer takes them so. Blender writes, by a choice of its exporter that the file does not
mention, either photometric units (its default since version 3.6), or radiometric ones, or its own: W/m² of a sun, and
the W that a point or spot light emits in all directions. Materials' emission is radiometric in all of them.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from math import pi

import numpy as np
from numpy.typing import NDArray

from ...scene.axes_and_units import LightUnit
from ...scene.lights import DirectionalLight, Light, PointLight, SpotLight, Vector

#: Luminous efficacy in lm/W of light of 555 nm, which defines the candela. Blender converts white light by it, too.
EFFICACY = 683.0
#: Irradiance of the brightest light above which it is taken as lux: it is near the geometric mean of what lights a
#: scene well, 1 to 10 W/m², and of the same in lux.
BRIGHTEST = 50.0
#: Blender's exporter before version 3.6 wrote the numbers that Blender shows.
OLD_BLENDER = re.compile(r"Khronos Blender glTF 2\.0|Khronos glTF Blender I/O v([0-2]\.|3\.[0-5]\.)")


def guess_unit(lights: Sequence[Light], generator: str, box: NDArray[np.floating]) -> LightUnit:
    """Return the unit of a file's lights, by the program that wrote it and by how brightly they light the scene.

    box: the scene's bounds, (2, 3).
    """
    if OLD_BLENDER.match(generator):
        return "blender"
    brightest = max((_irradiance(light, box) for light in lights), default=0.0)
    return "photometric" if brightest > BRIGHTEST else "radiometric"


def _irradiance(light: Light, box: NDArray[np.floating]) -> float:
    """Return the irradiance in the middle of the scene, or of a light in the scene, at the scene's radius."""
    if isinstance(light, PointLight | SpotLight):
        distance = float(np.linalg.norm(light.position - box.mean(axis=0)))
        distance = max(distance, float(np.linalg.norm(box[1] - box[0])) / 2)
        return max(light.intensity) / distance**2 if distance else 0.0
    assert isinstance(light, DirectionalLight)
    return max(light.irradiance)


def to_radiometric(light: Light, unit: LightUnit) -> Light:
    """Return the light with its number in W/sr, or in W/m² if it is directional."""
    if isinstance(light, DirectionalLight):
        factor = 1 / EFFICACY if unit == "photometric" else 1.0
        return replace(light, irradiance=_scaled(light.irradiance, factor))
    assert isinstance(light, PointLight | SpotLight)
    factor = {"photometric": 1 / EFFICACY, "radiometric": 1.0, "blender": 1 / (4 * pi)}[unit]
    return replace(light, intensity=_scaled(light.intensity, factor))


def _scaled(color: Vector, factor: float) -> Vector:
    """Return the color times the factor."""
    red, green, blue = color
    return (factor * red, factor * green, factor * blue)
