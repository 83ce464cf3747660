"""Kernel-side camera: its kernel file, and its fields of the launch record."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...device.programs.preamble import Buffers
from ...scene.cameras import Camera, View
from ...scene.exposure import frame_of_camera
from ...scene.geometry.motion import Turns
from ...scene.ray_list import RayList
from .records import CAMERA_MOTION, EXPOSURE, LAUNCH, LENS, LENS_MOTION, LISTED_RAY

#: Camera fields of every launch record.
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
        return {"LENS_MOTION": 1} if camera.type.distorts and camera.moves else {}
    return {"REPLICAS": camera.replicas, **({"ON_SURFACES": 1} if camera.on_surfaces else {})}


def launch_of(camera: Camera, kind: np.dtype[Any] = LAUNCH) -> np.dtype[Any]:
    """Return a launch record of a kind with the lens's distortion if the camera's kernel file reads that, and with the
    camera's motion if it moves."""
    lens, motion = LENS.descr * camera.type.distorts, CAMERA_MOTION.descr * camera.moves
    both = LENS_MOTION.descr * (camera.type.distorts and camera.moves)
    return np.dtype([*kind.descr, *lens, *motion, *both]) if lens or motion else kind


def camera_fields(kind: np.dtype[Any]) -> list[str]:
    """Return the names of the fields of a launch record that depend on the camera."""
    theirs = {
        *CAMERA_FIELDS,
        *(name for each in (LENS, CAMERA_MOTION, LENS_MOTION, EXPOSURE) for name in each.names or ()),
    }
    return [name for name in kind.names or () if name in theirs]


def launch_record(camera: Camera, size: tuple[int, int], kind: np.dtype[Any] = LAUNCH) -> NDArray[Any]:
    """Return a launch record of a kind with camera and size. The camera's kernel file defines right, up and forward."""
    width, height = size
    view = view_of(camera, size)
    record = np.zeros(1, launch_of(camera, kind))
    record["position"], record["lens_radius"] = camera.position, camera.aperture_radius
    record["right"], record["up"], record["forward"] = camera.type.axes(camera, view)
    record["width"], record["height"] = width, height
    if camera.type.distorts:
        _set_lens(record, camera, size)
    if camera.moves:
        _set_motion(record, camera, size)
    if "open_share" in (record.dtype.names or ()):
        record["open_share"] = (camera.shutter[1] - camera.shutter[0]) / camera.exposure
        record["row_share"] = camera.rolling_shutter / camera.exposure
    return record


def view_of(camera: Camera, size: tuple[int, int]) -> View:
    """Return the view of a camera for images of a size, at the start of its exposure."""
    forward = np.subtract(camera.look_at, camera.position, dtype=np.float64)
    distance = np.linalg.norm(forward)
    forward /= distance
    right = np.cross(forward, np.asarray(camera.up, np.float64))
    right /= np.linalg.norm(right)
    return View(right, np.cross(right, forward), forward, float(distance), *size)


def _set_motion(record: NDArray[Any], camera: Camera, size: tuple[int, int]) -> None:
    """Set the fields of CAMERA_MOTION."""
    frames, axes = [], []
    for each in (camera, camera.at_end):
        frames.append(frame_of_camera(each))
        axes.append(np.array(camera.type.axes(each, view_of(each, size))) @ frames[-1])
    turn = Turns.between(*(frame[None] for frame in frames))
    record["turn_middle"], record["turn_change"], record["turn_angle"] = turn
    record["moved"] = np.subtract(camera.at_end.position, camera.position)
    record["axes"], record["axes_change"] = axes[0], axes[1] - axes[0]


def _set_lens(record: NDArray[Any], camera: Camera, size: tuple[int, int]) -> None:
    """Set the fields of LENS, and those of LENS_MOTION if the camera moves."""
    lens, plane, end = camera.lens, _plane(camera, size), _plane(camera.at_end, size)
    farthest = 1 + 2 * BEYOND / np.array(size)
    corners = np.array([(x, y, 1) for x in (-farthest[0], farthest[0]) for y in (-farthest[1], farthest[1])])
    edge = max(float(np.linalg.norm(corners @ each[:2].T, axis=1).max()) for each in (plane, end))
    record["numerator"], record["denominator"], record["reach"] = lens.numerator, lens.denominator, lens.reach(edge)
    record["across"], record["down"], _ = plane
    record["p1"], record["p2"] = lens.tangential
    if camera.moves:
        record["across_change"], record["down_change"], _ = end - plane


def _plane(camera: Camera, size: tuple[int, int]) -> NDArray[np.float64]:
    """Return the matrix (3, 3) from image positions (sx, sy, 1) to the image plane at distance 1."""
    width, height = size
    pixels = np.array([[width / 2, 0, width / 2], [0, height / 2, height / 2], [0, 0, 1]])
    return np.linalg.solve(camera.matrix(size), pixels)
