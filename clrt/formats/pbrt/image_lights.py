"""pbrt's point lights with an image of their radiant intensity: projection and goniometric."""

from __future__ import annotations

from dataclasses import replace
from math import atan, degrees, pi, radians, tan
from pathlib import Path

import numpy as np

from ...scene.light_images import LightImage
from ...scene.lights import GoniometricLight, ProjectorLight
from ..images.image_reader import read_picture
from ..images.turned_environment import resampled
from ..scene_parts.camera_axes import lengths_of
from ..scene_parts.light_axes import oriented
from ..scene_parts.notes import Notes
from ..scene_parts.texture_images import LUMINANCE
from .entities import Entity
from .equal_area import square_of
from .powers import powered
from .spectra import Spectra
from .tokens import Doubles

#: Minimum number of rows that an equal-area image is resampled to, and of rows per row of its own.
ROWS, FINER = 512, 8
#: Maximum number of rows, unless it has more itself.
MOST_ROWS = 2048


def projection(entity: Entity, spectra: Spectra, notes: Notes, mirror: Doubles, old: bool) -> ProjectorLight:
    """Read a projection light: +x to the right, +z forward, and +y up, in v3 down. mirror: see `lights.light`."""
    image = _image(entity, notes, old)
    axes, (across, _, along) = _axes(entity, mirror)
    wide, high = _half_size(image.aspect)
    fov = entity.number("fov", 45.0 if old else 90.0)
    if not 0 < fov < 180:
        raise entity.fault("fov", f"is {fov:g}", "write more than 0 and less than 180 degrees")
    spread = tan(radians(fov) / 2)
    strength = spectra.emission(entity, "I")
    if not old:
        strength = powered(strength, entity, _flux(image, spread * wide, spread * high))
    right, top, forward = axes.T
    return ProjectorLight(
        position=_place(entity, mirror),
        intensity=strength,
        fov_degrees=degrees(2 * atan(spread * high * across / along)),
        image_of="intensity",
        **oriented(image, right, top, forward),
    )


def goniometric(entity: Entity, spectra: Spectra, notes: Notes, mirror: Doubles, old: bool) -> GoniometricLight:
    """Read a goniometric light. Its image is equirectangular in v3, with +y on top and the longitude counted from +x
    towards +z, and a square of equal areas in v4, with +y in the middle. mirror: see `lights.light`."""
    image = _image(entity, notes, old)
    axes, _ = _axes(entity, mirror)
    strength = spectra.emission(entity, "I")
    light = GoniometricLight(position=_place(entity, mirror), intensity=strength)
    if old:
        return replace(light, **oriented(image, -axes[:, 2], axes[:, 1], -axes[:, 0]))
    rows, columns = image.pixels.shape[:2]
    if rows != columns:
        raise entity.fault("filename", f"is an image of {columns}x{rows} pixels", "give a square one, of equal areas")
    values = np.repeat(image.pixels.mean(axis=2, keepdims=True), 3, axis=2)

    def lookup(u: Doubles, v: Doubles) -> Doubles:
        phi, across = 2 * np.pi * u, np.sin(np.pi * v)
        # From the axes of maps to those of the light, whose y and z are exchanged for those of the square.
        x, y, z = across * np.sin(phi), np.cos(np.pi * v), -across * np.cos(phi)
        column, row = np.minimum(square_of(np.column_stack([x, z, y])) * rows, rows - 1).astype(int).T
        return np.asarray(values[row, column], np.float64)

    notes.differ(entity, "its image is resampled")
    found = resampled(lookup, axes, max(ROWS, min(FINER * rows, MOST_ROWS), rows))
    shown = LightImage(pixels=found, name=image.name)
    return replace(light, intensity=powered(strength, entity, 4 * pi * float(values.mean())), image=shown)


def _image(entity: Entity, notes: Notes, old: bool) -> LightImage:
    """Return the image of a light: white in v3 if there is none, interpolated linearly and repeated there."""
    path = entity.path("mapname" if old else "filename")
    if not path:
        if not old:
            raise entity.fault("filename", "is missing", "name an image")
        return LightImage(pixels=np.ones((1, 1, 3), np.float32), name="white")
    pixels, name = np.maximum(read_picture(path), 0), Path(path).stem
    if not old:
        return LightImage(pixels=pixels, name=name, filter="nearest")
    if any(size & (size - 1) for size in pixels.shape[:2]):
        notes.differ(entity, "its image is interpolated linearly; pbrt-v3 resamples it to powers of two")
    upside_down = {"scale": (1.0, -1.0), "offset": (0.0, 1.0)} if entity.kind == "projection" else {}
    return LightImage(pixels=pixels, name=name, wrap=("repeat", "repeat"), **upside_down)  # type: ignore[arg-type]


def _axes(entity: Entity, mirror: Doubles) -> tuple[Doubles, tuple[float, float, float]]:
    """Return the unit axes of a light in clrt's world, the columns (3, 3), and their lengths."""
    axes = mirror @ entity.to_world[:3, :3]
    lengths = lengths_of(entity, axes, "its transformation", f"{entity.kind} light")
    return axes / lengths, lengths


def _half_size(aspect: float) -> tuple[float, float]:
    """Return half the width and height of the image, of which the smaller is 1."""
    return (aspect, 1.0) if aspect > 1 else (1.0, 1 / aspect)


def _flux(image: LightImage, wide: float, high: float) -> float:
    """Return the power of a projection of intensity 1: its luminance times the pixels' solid angles. wide, high: half
    the size of the image at the distance 1."""
    rows, columns = image.pixels.shape[:2]
    x, y = ((np.arange(count) + 0.5) / count * 2 - 1 for count in (columns, rows))
    cubes = (1 + (wide * x) ** 2 + (high * y[:, None]) ** 2) ** -1.5
    return float(4 * wide * high * np.mean(image.pixels @ LUMINANCE * cubes))


def _place(entity: Entity, mirror: Doubles) -> tuple[float, float, float]:
    x, y, z = (mirror @ entity.to_world[:3, 3]).tolist()
    return x, y, z
