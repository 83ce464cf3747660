"""Cameras of a glTF file, by name."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...scene.editing import free_name
from ...scene.geometry.transform import Matrix, unit
from ...scene.model import Camera
from . import schema as gltf


def read_cameras(
    document: gltf.Document, nodes: Iterable[tuple[gltf.Node, Matrix]], middle: NDArray[np.float64]
) -> tuple[dict[str, Camera], list[str]]:
    """Return the cameras of the scene by name: that of the node, else the camera's own, else "camera N".

    A number is appended to a name in use. The look_at point is as far away as `middle`, (3,). Cameras without a view
    angle or height are left out; the second value describes them.
    """
    cameras: dict[str, Camera] = {}
    left_out: list[str] = []
    for node, matrix in nodes:
        if node.camera is None:
            continue
        source = gltf.entry(document.cameras, node.camera, "camera", "a node")
        name = free_name(node.name or source.name or f"camera {node.camera}", cameras)
        if source.perspective is None and (source.orthographic is None or source.orthographic.ymag == 0):
            left_out.append(f'camera "{name}", which has neither an angle nor a height')
        elif (camera := _placed(source, matrix, middle)) is not None:
            cameras[name] = camera
    return cameras, left_out


def _placed(source: gltf.Camera, matrix: Matrix, middle: NDArray[np.float64]) -> Camera | None:
    """Return a camera along its node's −Z with +Y up (specification 3.10); None if the node is degenerate."""
    position = matrix[:3, 3]
    forward, up = unit(-matrix[:3, 2]), unit(matrix[:3, 1])
    if not np.cross(forward, up).any():
        return None
    distance = np.linalg.norm(middle - position) or 1.0
    x, y, z = position.tolist()
    at_x, at_y, at_z = (position + distance * forward).tolist()
    up_x, up_y, up_z = up.tolist()
    camera = Camera(position=(x, y, z), look_at=(at_x, at_y, at_z), up=(up_x, up_y, up_z))
    if source.perspective is not None:
        return replace(camera, fov_degrees=math.degrees(source.perspective.yfov))
    assert source.orthographic is not None
    return replace(camera, projection="orthographic", view_height=2 * abs(source.orthographic.ymag))
