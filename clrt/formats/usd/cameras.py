"""Cameras of a USD stage, by name."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...file_names import printable
from ...scene.editing import free_name
from ...scene.geometry.transform import Matrix, unit
from ...scene.model import Camera


def read_cameras(
    facts: list[dict[str, Any]], upright: Matrix, middle: NDArray[np.float64]
) -> tuple[dict[str, Camera], list[str]]:
    """Return the cameras by name, along their −Z with +Y up, and descriptions of what is ignored.

    upright: from the stage's axes and unit to the scene's. The look_at point is in focus, or as far as `middle`, (3,).
    """
    cameras: dict[str, Camera] = {}
    ignored: list[str] = []
    for source in facts:
        name = free_name(printable(source["name"]), cameras)
        camera = _placed(source, upright, middle)
        if camera is None:
            ignored.append(f'camera "{name}", which has no angle, height or direction')
            continue
        if source["offset"]:
            ignored.append(f'the aperture offset of camera "{name}"')
        cameras[name] = camera
    return cameras, ignored


def _placed(source: dict[str, Any], upright: Matrix, middle: NDArray[np.float64]) -> Camera | None:
    matrix = upright @ np.array(source["matrix"])
    position, forward, up = matrix[:3, 3], unit(-matrix[:3, 2]), unit(matrix[:3, 1])
    if not np.cross(forward, up).any() or not np.isfinite(position).all():
        return None
    # Lengths of the lens are in the stage's unit, whatever the camera's own scale is.
    meters = float(np.linalg.norm(upright[:3, 0]))
    focus = source["focus_distance"] * meters
    distance = focus if focus > 0 and np.isfinite(focus) else float(np.linalg.norm(middle - position)) or 1.0
    x, y, z = position.tolist()
    at_x, at_y, at_z = (position + distance * forward).tolist()
    up_x, up_y, up_z = up.tolist()
    camera = Camera(position=(x, y, z), look_at=(at_x, at_y, at_z), up=(up_x, up_y, up_z))
    if not source["perspective"]:
        height = source["height"] * meters
        return replace(camera, projection="orthographic", view_height=height) if height > 0 else None
    if not 0 < source["fov"] < 180:
        return None
    f_stop = source["f_stop"]
    aperture = source["focal_length"] * meters / (2 * f_stop) if f_stop > 0 and focus > 0 else 0.0
    return replace(camera, fov_degrees=source["fov"], aperture_radius=aperture)
