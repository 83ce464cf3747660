"""pbrt's infinite lights as an environment."""

from __future__ import annotations

from math import pi
from pathlib import Path

import numpy as np

from ...errors import SceneError
from ...scene.model import Environment, FloatArray
from ..images.image_reader import read_picture
from ..images.turned_environment import TURN, interpolated, resampled, turned_about_y
from ..scene_parts.notes import Notes
from ..scene_parts.texture_images import LUMINANCE
from .entities import Entity
from .equal_area import direction_of, looked_up
from .spectra import Spectra
from .tokens import Doubles

#: Minimum and maximum number of rows that a map is resampled to, unless it has more itself.
ROWS, MOST_ROWS = 1024, 2048
#: From pbrt's axes, in which +z is up and longitude is counted from +x towards +y, to those of clrt's maps.
AXES = np.array([(0.0, 1, 0), (0, 0, 1), (-1, 0, 0)])


def environment(lights: list[Entity], spectra: Spectra, notes: Notes, mirror: Doubles, old: bool) -> Environment:
    """Return the sum of infinite lights, of which one may be an image. mirror: see `lights.light`."""
    color = np.zeros(3)
    maps: list[tuple[Entity, Doubles, FloatArray]] = []
    for entity in lights:
        entity.ignore(("samples", "nsamples"))
        if "portal" in entity.parameters:  # which affects how the light is sampled, and what it lights outside
            notes.differ(entity, "the light of a portal also comes from other directions")
            entity.ignore(["portal"])
        name = "mapname" if "mapname" in entity.parameters else "filename"
        path = entity.path(name)
        strength = np.array(spectra.emission(entity, "L"))
        illuminance = entity.number("illuminance", -1.0)
        if not path:
            color += strength * (illuminance / pi if illuminance > 0 else 1)
            continue
        image = read_picture(path)
        is_square = not old and name == "filename" and image.shape[0] == image.shape[1]
        if not is_square and not old and name == "filename":
            notes.differ(entity, "its image is not square, so it is taken for an equirectangular one")
        if illuminance > 0:
            strength = strength * illuminance / _illuminance(image, is_square)
        maps.append((entity, strength, image))
    if not maps:
        red, green, blue = color.tolist()
        return Environment(color=(red, green, blue))
    for entity, _, _ in maps[1:]:
        notes.instead(
            entity, "a second image lights the scene", "add the images up", "it is left out", "several infinite images"
        )
    entity, strength, image = maps[0]
    return _mapped(entity, image, strength, color, mirror, old, notes)


def _mapped(
    entity: Entity, image: FloatArray, strength: Doubles, added: Doubles, mirror: Doubles, old: bool, notes: Notes
) -> Environment:
    """Return the environment of an image, times `strength` plus a color."""
    linear = entity.to_world[:3, :3]
    size = float(np.cbrt(abs(np.linalg.det(linear))))
    if not size or np.abs(linear.T @ linear / size**2 - np.eye(3)).max() > TURN:
        entity.refuse("its transformation stretches or shears", "only rotate or mirror it", "infinite light, stretched")
    turn = mirror @ (linear / size) @ AXES.T
    rows, columns = image.shape[:2]
    is_square = not old and "filename" in entity.parameters and rows == columns
    if not is_square and (angle := turned_about_y(turn)) is not None:
        found, rotation = image, angle
    else:

        def lookup(u: Doubles, v: Doubles) -> Doubles:
            if not is_square:
                return interpolated(image, u * columns - 0.5, v * rows - 0.5)
            phi, theta = 2 * np.pi * u, np.pi * v
            across = np.sin(theta)
            return looked_up(image, np.column_stack([across * np.cos(phi), across * np.sin(phi), np.cos(theta)]))

        notes.differ(entity, "its image is resampled")
        found, rotation = resampled(lookup, turn, max(ROWS, min(2 * rows, MOST_ROWS), rows)), 0.0
    if not np.isfinite(found).all():
        raise SceneError(
            f"{entity.at}: {Path(entity.path('filename') or entity.path('mapname')).name} has NaN or Inf; save it again"
        )
    if added.any() or np.ptp(strength) > 0:
        return Environment(image=(found * strength + added).astype(np.float32), rotation_degrees=rotation)
    return Environment(image=found, strength=float(strength[0]), rotation_degrees=rotation)


def _illuminance(image: FloatArray, is_square: bool) -> float:
    """Return what an image gives a surface that faces +z."""
    rows, columns = image.shape[:2]
    if is_square:
        row, column = np.divmod(np.arange(rows * columns), columns)
        z = direction_of(np.column_stack([(column + 0.5) / columns, (row + 0.5) / rows]))[:, 2]
        weight = np.maximum(z, 0).reshape(rows, columns) * 4 * pi / (rows * columns)
    else:
        theta = np.pi * (np.arange(rows) + 0.5) / rows
        weight = (np.maximum(np.cos(theta), 0) * np.sin(theta) * 2 * pi**2 / (rows * columns))[:, None]
    found = float((weight * (image @ LUMINANCE)).sum())
    return found if found > 0 else 1.0
