"""Conversion of pbrt's cameras, whose axes are +x to the right, +y up and +z forward."""

from __future__ import annotations

from dataclasses import replace
from math import atan, degrees, radians, tan
from typing import NamedTuple

import numpy as np

from ...scene.model import Camera
from ..scene_parts.camera_axes import lengths_of
from ..scene_parts.notes import Notes
from .entities import Entity
from .shutter import Shutter
from .tokens import Doubles

#: Tolerance of a screen window's shape and place.
OFF = 1e-3
#: Where the middle of a spherical camera's image is, and what is right of it there.
MIDDLE, ACROSS = np.array([-1.0, 0, 0]), np.array([0.0, 0, -1])
#: Stand-in for the angle of a realistic camera, along the shorter side.
REALISTIC = 40.0
#: Kinds that render all directions.
ROUND = ("spherical", "environment")


def mirror_of(camera: Entity) -> Doubles:
    """Return the matrix (3, 3) from pbrt's world to one in which clrt's camera, whose image's right is forward × up,
    sees the same image: the identity, or a reflection, as pbrt's coordinates are left-handed."""
    axes = np.linalg.inv(camera.to_world)[:3, :3]
    right, forward = (ACROSS, MIDDLE) if camera.kind in ROUND else (np.eye(3)[0], np.eye(3)[2])
    side = np.cross(axes @ forward, axes[:, 1])
    return np.diag([1.0 if side @ (axes @ right) > 0 else -1.0, 1, 1])


def exposed_camera(entity: Entity, size: tuple[int, int], mirror: Doubles, notes: Notes, shutter: Shutter) -> Camera:
    """Read the camera for an image of this size, with its motion."""
    start, end = shutter.poses(entity.to_world, entity.to_world_end)
    poses = [replace(entity, to_world=pose) for pose in (start, end) if pose is not None]
    camera, *last = [camera_of(each, size, mirror, notes) for each in poses]
    return camera.moving_to(last[0]) if last else camera


def camera_of(entity: Entity, size: tuple[int, int], mirror: Doubles, notes: Notes) -> Camera:
    """Read the camera for an image of this size. mirror: see `mirror_of`."""
    entity.ignore(("hither", "yon"))
    to_world = np.linalg.inv(entity.to_world)
    axes, place = mirror @ to_world[:3, :3], mirror @ to_world[:3, 3]
    across, upright, along = lengths_of(entity, axes, "its transformation")
    forward, up = axes[:, 2] / along, axes[:, 1]
    if entity.kind in ROUND:
        return _round(entity, place, axes, notes)
    if entity.kind not in ("perspective", "orthographic", ""):
        what = f'camera "{entity.kind}" is not supported'
        entity.ignore()
        remedy = "use perspective, orthographic or spherical"
        notes.instead(entity, what, remedy, f"a perspective one of {REALISTIC:g} degrees is used")
    window = _window(entity, size, notes)
    height = window.height
    radius, distance = entity.number("lensradius", 0.0) * across, entity.number("focaldistance", 1e6) * along
    camera = Camera(position=place.tolist(), look_at=(place + forward).tolist(), up=up.tolist())
    if entity.kind == "orthographic":
        if radius:
            notes.instead(entity, "has a lens", "leave lensradius out", "it is left out", "orthographic lens")
        return replace(camera, projection="orthographic", view_height=height * upright)
    entity.ignore(["halffov"])
    default = 2 * entity.number("halffov", 45.0)
    angle = entity.number("fov", default) if entity.kind in ("perspective", "") else REALISTIC
    if not 0 < angle < 180:
        raise entity.fault("fov", f"is {angle:g}", "write more than 0 and less than 180 degrees")
    return replace(
        camera,
        lens_shift=window.shift,
        pixel_aspect=window.pixel_aspect,
        fov_degrees=degrees(2 * atan(tan(radians(angle) / 2) * height / 2)),
        aperture_radius=radius,
        focus_distance=distance if radius else None,
    )


def _round(entity: Entity, place: Doubles, axes: Doubles, notes: Notes) -> Camera:
    entity.ignore(("lensradius", "focaldistance", "screenwindow", "frameaspectratio"))
    default = "equalarea" if entity.kind == "spherical" else "equirectangular"
    if (mapping := entity.string("mapping", default)) != "equirectangular":
        what, remedy = f'mapping "{mapping}" is not supported', "write equirectangular"
        notes.instead(entity, what, remedy, "equirectangular is used", f"spherical camera, {mapping}")
    seen = place + axes @ MIDDLE
    return Camera(position=place.tolist(), look_at=seen.tolist(), up=axes[:, 1].tolist(), projection="equirectangular")


class _Window(NamedTuple):
    """The screen window: its height, its center from the axis in widths and heights, and the pixels' aspect."""

    height: float
    shift: tuple[float, float]
    pixel_aspect: float


def _window(entity: Entity, size: tuple[int, int], notes: Notes) -> _Window:
    """Return the screen window, which by default is 2 along the shorter side. Of an orthographic camera it is centered
    and has the shape of the image."""
    aspect = size[0] / size[1]
    frame = entity.number("frameaspectratio", aspect)
    wide, high = (2 * frame, 2.0) if frame > 1 else (2.0, 2 / frame if frame > 0 else 2.0)
    shift, rows = (0.0, 0.0), entity.rows("screenwindow", 4, "float", "integer")
    if rows is not None and len(rows):
        left, right, low, top = rows[0].tolist()
        wide, high = right - left, top - low
        if not wide > 0 or not high > 0:
            raise entity.fault("screenwindow", "is empty", "write left, right, bottom and top")
        shift = (left + right) / (2 * wide), (low + top) / (2 * high)
    stretch = wide / (high * aspect)
    if entity.kind != "orthographic":
        return _Window(high, shift, stretch if abs(stretch - 1) > OFF else 1.0)
    if max(map(abs, shift)) > OFF / 2:
        what, remedy = "screenwindow is not centered", "center it"
        notes.instead(entity, what, remedy, "it is centered", "camera, shifted screen window")
    if abs(stretch - 1) > OFF:
        what, remedy = "its screen has not the shape of the image", "leave screenwindow and frameaspectratio out"
        notes.instead(entity, what, remedy, "its height is used", "camera that stretches the image")
    return _Window(high, (0.0, 0.0), 1.0)
