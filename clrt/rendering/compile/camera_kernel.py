"""Kernel-side camera: its kernel file, and its fields of the launch record."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...device.programs.preamble import Buffers
from ...scene.cameras import Camera, View
from ...scene.ray_list import RayList
from .records import LAUNCH, LENS, LISTED_RAY

#: Camera fields of the launch record.
CAMERA_FIELDS = ("position", "right", "up", "forward", "lens_radius")
#: How far beyond the image's edges the widest filter reaches, in pixels, generously.
BEYOND = 4


def camera_file(camera: Camera, integrator: str) -> str:
    """Return the kernel file that generates its rays. Integrator `depth` uses the ray through the lens center."""
    lens = camera.type.lens_kernel if camera.aperture_radius and integrator != "depth" else None
    return f"camera/{lens or camera.type.kernel}.cl"


def camera_buffers(camera: Camera) -> Buffers:
    """Return the buffers that its kernel file reads: those of a RayList, as many rays as fill the image."""
    if not isinstance(camera, RayList):
        return {}
    width, height = camera.size
    rays, count = np.zeros(width * height // camera.replicas, LISTED_RAY), len(camera.origins)
    rays["direction"] = camera.directions[0]
    rays["origin"][:count] = camera.origins
    rays["direction"][:count] = camera.directions
    if camera.on_surfaces:
        rays["surface_normal"][:count] = camera.surface_normals
        rays["reach"] = camera.reach
    return {"listed_rays": ("ListedRay", rays)}


def camera_defines(camera: Camera) -> dict[str, int]:
    """Return the macros that its kernel file reads."""
    if not isinstance(camera, RayList):
        return {}
    return {"REPLICAS": camera.replicas, **({"ON_SURFACES": 1} if camera.on_surfaces else {})}


def launch_of(camera: Camera, kind: np.dtype[Any] = LAUNCH) -> np.dtype[Any]:
    """Return a launch record of a kind with the lens's distortion if the camera's kernel file reads that."""
    return np.dtype([*kind.descr, *LENS.descr]) if camera.type.distorts else kind


def camera_fields(camera: Camera) -> tuple[str, ...]:
    """Return the names of the fields of its launch record that depend on the camera."""
    return CAMERA_FIELDS + (LENS.names or ()) * camera.type.distorts


def launch_record(camera: Camera, size: tuple[int, int], kind: np.dtype[Any] = LAUNCH) -> NDArray[Any]:
    """Return a launch record of a kind with camera and size. The camera's kernel file defines right, up and forward."""
    width, height = size
    forward = np.subtract(camera.look_at, camera.position, dtype=np.float64)
    distance = np.linalg.norm(forward)
    forward /= distance
    right = np.cross(forward, np.asarray(camera.up, np.float64))
    right /= np.linalg.norm(right)
    view = View(right, np.cross(right, forward), forward, float(distance), width, height)
    record = np.zeros(1, launch_of(camera, kind))
    record["position"], record["lens_radius"] = camera.position, camera.aperture_radius
    record["right"], record["up"], record["forward"] = camera.type.axes(camera, view)
    record["width"], record["height"] = width, height
    if camera.type.distorts:
        _set_lens(record, camera, size)
    return record


def _set_lens(record: NDArray[Any], camera: Camera, size: tuple[int, int]) -> None:
    """Set the fields of LENS."""
    lens, (width, height) = camera.lens, size
    pixels = np.array([[width / 2, 0, width / 2], [0, height / 2, height / 2], [0, 0, 1]])  # of (sx, sy, 1)
    plane = np.linalg.solve(camera.matrix(size), pixels)
    farthest = 1 + 2 * BEYOND / np.array(size)
    corners = np.array([(x, y, 1) for x in (-farthest[0], farthest[0]) for y in (-farthest[1], farthest[1])])
    edge = float(np.linalg.norm(corners @ plane[:2].T, axis=1).max())
    record["numerator"], record["denominator"], record["reach"] = lens.numerator, lens.denominator, lens.reach(edge)
    record["across"], record["down"], _ = plane
    record["p1"], record["p2"] = lens.tangential
