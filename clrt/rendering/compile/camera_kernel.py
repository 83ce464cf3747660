"""Kernel-side camera: its kernel file, and its fields of the LAUNCH record."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...scene.model import Camera
from .records import LAUNCH

FILES = {"perspective": "camera/pinhole.cl", "orthographic": "camera/orthographic.cl",
         "equirectangular": "camera/equirectangular.cl"}
#: Camera fields of the LAUNCH record.
CAMERA_FIELDS = ("position", "right", "up", "forward", "lens_radius")


def camera_file(camera: Camera, integrator: str) -> str:
    """Return the kernel file that generates its rays. Integrator `depth` uses the ray through the lens center."""
    return "camera/thin_lens.cl" if camera.aperture_radius and integrator != "depth" else FILES[camera.projection]


def launch_record(camera: Camera, size: tuple[int, int]) -> NDArray[Any]:
    """Return a LAUNCH record with camera and size. The camera's kernel file defines right, up and forward."""
    width, height = size
    forward = np.subtract(camera.look_at, camera.position, dtype=np.float64)
    distance = np.linalg.norm(forward)
    forward /= distance
    right = np.cross(forward, np.asarray(camera.up, np.float64))
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    extent = np.tan(np.radians(camera.fov_degrees) / 2)
    match camera.projection:
        case "perspective":
            focus = (camera.focus_distance or distance) if camera.aperture_radius else 1.0
            right, up, forward = right * focus * extent * width / height, up * focus * extent, forward * focus
        case "orthographic":
            extent = camera.view_height / 2 if camera.view_height else extent * distance
            right, up = right * extent * width / height, up * extent
    record = np.zeros(1, LAUNCH)
    record["position"], record["right"], record["up"], record["forward"] = camera.position, right, up, forward
    record["lens_radius"], record["width"], record["height"] = camera.aperture_radius, width, height
    return record
