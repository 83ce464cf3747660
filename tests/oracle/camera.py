"""Camera rays, following the projections in docs/scene-format.md."""

from __future__ import annotations

import numpy as np

from clrt.scene.model import Camera

from .vectors import Doubles, unit


def camera_rays(
    camera: Camera, size: tuple[int, int], pixel: Doubles, rng: np.random.Generator
) -> tuple[Doubles, Doubles]:
    """Return origins and unit directions (n, 3) through points (n, 2) of an image of `size` (width, height), in
    pixels from its upper left corner."""
    width, height = size
    position = np.array(camera.position, float)
    ahead = np.array(camera.look_at, float) - position
    distance = float(np.linalg.norm(ahead))
    forward = ahead / distance
    right = unit(np.cross(forward, np.array(camera.up, float)))
    up = np.cross(right, forward)
    x, y = (pixel / size).T[..., None]  # from 0 to 1, down
    if camera.projection == "equirectangular":
        # As an environment map, for a view along +Z: forward in the middle, backward at the left edge.
        longitude, polar = 2 * np.pi * (x - 0.5), np.pi * y
        level = np.cos(longitude) * forward + np.sin(longitude) * right
        return np.tile(position, (len(pixel), 1)), np.sin(polar) * level + np.cos(polar) * up
    if camera.projection == "fisheye":
        # Equidistant: the angle from the view is proportional to the distance from the image's center.
        across = (x - 0.5) * width / height * right + (0.5 - y) * up
        theta = np.radians(camera.fisheye_degrees) * np.linalg.norm(across, axis=1, keepdims=True)
        return np.tile(position, (len(pixel), 1)), np.cos(theta) * forward + np.sin(theta) * unit(across)
    half_height = float(np.tan(np.radians(camera.fov_degrees) / 2))
    aspect = width / height
    if camera.projection == "orthographic":
        half_height = camera.view_height / 2 if camera.view_height else half_height * distance
        across = (2 * x - 1) * half_height * aspect * right + (1 - 2 * y) * half_height * up
        return position + across, np.tile(forward, (len(pixel), 1))
    through = (2 * x - 1) * half_height * aspect * right + (1 - 2 * y) * half_height * up + forward
    if not camera.aperture_radius:
        return np.tile(position, (len(pixel), 1)), unit(through)
    angle = 2 * np.pi * rng.random((len(pixel), 1))
    radius = camera.aperture_radius * np.sqrt(rng.random((len(pixel), 1)))
    lens = radius * (np.cos(angle) * right + np.sin(angle) * up)
    return position + lens, unit(through * (camera.focus_distance or distance) - lens)
