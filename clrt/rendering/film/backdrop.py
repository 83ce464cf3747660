"""The backdrop as the pixels of an image: what the camera sees behind the scene."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...scene.model import Backdrop, Scene

FloatArray = NDArray[np.float32]


def sees_environment(scene: Scene) -> bool:
    """Return whether the camera sees the environment behind the scene."""
    hidden = scene.render.transparent or scene.backdrop is not None or not scene.environment.camera_visible
    return not (hidden or catches(scene))


def catches(scene: Scene) -> bool:
    """Return whether surfaces of the scene are catchers, and not shown as any others."""
    materials = [mesh.material for mesh in scene.meshes] + [sphere.material for sphere in scene.spheres]
    materials += [each.material or each.mesh.material for each in scene.instances]
    return scene.render.integrator in ("path", "direct") and any(material.catcher for material in materials)


def backdrop_of(scene: Scene) -> FloatArray | None:
    """Return what is behind the scene, (height, width, 3) or (1, 1, 3): black if the environment is hidden without a
    backdrop; None if the image is transparent there, or shows the environment."""
    if scene.render.transparent:
        return None
    if scene.backdrop is not None:
        return backdrop_pixels(scene.backdrop, scene.render.size)
    return None if sees_environment(scene) else np.zeros((1, 1, 3), np.float32)


def backdrop_pixels(backdrop: Backdrop, size: tuple[int, int]) -> FloatArray:
    """Return the backdrop of an image of (width, height): (height, width, 3), or (1, 1, 3) of one color.

    A pixel is the mean of the backdrop's image over its area. The image is as large as it must be to fill the rendered
    one, whose center is its own.
    """
    image = backdrop.image
    if image is None:
        return np.array(backdrop.color, np.float32).reshape(1, 1, 3)
    height, width = image.shape[:2]
    scale = min(width / size[0], height / size[1])  # texels per pixel
    columns = _means(width, size[0], scale)
    rows = _means(height, size[1], scale)
    across = np.tensordot(columns, image.astype(np.float64), (1, 1))  # (columns, rows of the image, 3)
    return np.ascontiguousarray(np.tensordot(rows, across, (1, 1)), np.float32)


def _means(texels: int, pixels: int, scale: float) -> NDArray[np.float64]:
    """Return the weights (pixels, texels) of the texels that pixels cover, `scale` texels each, around the middle."""
    edges = (texels + scale * (2 * np.arange(pixels + 1) - pixels)) / 2
    starts = np.arange(texels)
    covered = np.minimum(edges[1:, None], starts + 1) - np.maximum(edges[:-1, None], starts)
    weights = np.maximum(covered, 0)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))
