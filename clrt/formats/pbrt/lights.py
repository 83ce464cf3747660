"""pbrt's lights without a shape: point, spot and distant; infinite ones are in infinite.py, those with an image in
image_lights.py."""

from __future__ import annotations

from math import cos, pi, radians

import numpy as np

from ...scene.lights import DirectionalLight, Light, PointLight, SpotLight
from ..scene_parts.notes import Notes
from .entities import Entity
from .image_lights import goniometric, projection
from .named_spectra import Triple
from .powers import powered, times
from .spectra import Spectra
from .tokens import Doubles

#: Kinds of lights that are the environment.
INFINITE = ("infinite", "exinfinite")
#: Smallest difference in degrees between the cones of a spot.
SHARPEST = 1e-3


def light(entity: Entity, spectra: Spectra, notes: Notes, mirror: Doubles, old: bool) -> Light | None:
    """Read a light that is not infinite. mirror: (3, 3), from pbrt's world to clrt's. Raises UnsupportedError for
    others; None if they may be left out."""
    entity.ignore(("samples", "nsamples"))
    if entity.kind == "point":
        strength = powered(spectra.emission(entity, "I"), entity, 4 * pi)
        return PointLight(position=_place(entity, "from", mirror), intensity=strength)
    if entity.kind == "spot":
        return _spot(entity, spectra, notes, mirror, old)
    if entity.kind == "projection":
        return projection(entity, spectra, notes, mirror, old)
    if entity.kind == "goniometric":
        return goniometric(entity, spectra, notes, mirror, old)
    if entity.kind == "distant":
        start, end = (entity.point(name, default) for name, default in (("from", (0, 0, 0)), ("to", (0, 0, 1))))
        strength = spectra.emission(entity, "L")
        illuminance = entity.number("illuminance", -1.0)
        if illuminance > 0:
            strength = times(strength, illuminance)
        return DirectionalLight(direction=_direction(entity, start, end, mirror), irradiance=strength)
    entity.ignore()
    known = "use point, spot, projection, goniometric, distant or infinite"
    notes.instead(entity, f'light "{entity.kind}" is not supported', known, "it is left out")
    return None


def _spot(entity: Entity, spectra: Spectra, notes: Notes, mirror: Doubles, old: bool) -> SpotLight:
    outer = entity.number("coneangle", 30.0)
    inner = max(outer - entity.number("conedeltaangle", 5.0), 0.0)
    end, start = cos(radians(outer)), cos(radians(inner))
    strength = powered(spectra.emission(entity, "I"), entity, 2 * pi * ((1 - start) + (start - end) / 2))
    if outer > 90:
        notes.instead(entity, f"coneangle is {outer:g}", "write 90 or less", "90 is used", "spot wider than 90")
        outer = 90.0
    if inner > outer - SHARPEST:
        inner = max(outer - SHARPEST, 0.0)
    else:
        notes.differ(entity, "between its cones the spot falls off by the angle, in pbrt smoothly by the cosine")
    begin = entity.point("from", (0, 0, 0))
    return SpotLight(
        position=_place(entity, "from", mirror),
        direction=_direction(entity, begin, entity.point("to", (0, 0, 1)), mirror),
        intensity=strength,
        inner_degrees=inner,
        outer_degrees=outer,
        falloff="cosine" if old else "angle",  # of v3's fourth power and v4's smooth step, by their mean
    )


def _place(entity: Entity, name: str, mirror: Doubles) -> Triple:
    x, y, z = (mirror @ (entity.to_world[:3] @ [*entity.point(name, (0, 0, 0)), 1])).tolist()
    return x, y, z


def _direction(entity: Entity, start: Doubles, end: Doubles, mirror: Doubles) -> Triple:
    along = np.asarray(end) - start
    if not along.any():
        raise entity.fault("to", "is the same point as from", "move one")
    x, y, z = (mirror @ entity.to_world[:3, :3] @ along).tolist()
    return x, y, z
