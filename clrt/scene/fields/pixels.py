"""Validation of images that are fields of the scene's dataclasses."""

from __future__ import annotations

import numpy as np

from .field_types import show
from .valid_arrays import faults_once


def image_faults(image: object, color: tuple[float, float, float]) -> list[str]:
    """Return problems of an `image` that replaces a `color`, if there is one."""
    if image is None:
        return []
    if any(color):
        return [f"color: {show(color)} has no effect with an image; leave one of them out"]
    return pixel_faults("image", image)


def pixel_faults(name: str, image: object) -> list[str]:
    """Return problems unless it is an array (h, w, 3) of float32, finite and at least 0."""
    return faults_once(image, "pixels", lambda: _pixel_faults(name, image))


def _pixel_faults(name: str, image: object) -> list[str]:
    if not isinstance(image, np.ndarray) or image.dtype != np.float32:
        kind = image.dtype if isinstance(image, np.ndarray) else type(image).__name__
        return [f"{name}: is {kind}; write an array of float32, of linear values"]
    if image.ndim != 3 or image.shape[2] != 3 or 0 in image.shape:
        return [f"{name}: has shape {image.shape}; it must be (height, width, 3) with at least one pixel"]
    problems = []
    for bad, fault in ((~np.isfinite(image), "not finite"), (image < 0, "negative")):
        if bad.any():
            pixels = bad.any(axis=2)
            row, column = np.argwhere(pixels)[0]
            pixel = show(tuple(float(f"{value:.6g}") for value in image[row, column]))
            problems.append(
                f"{name}: {np.count_nonzero(pixels)} pixels are {fault}, the first in row {row}, column {column}: "
                f"{pixel}; repair the image"
            )
    return problems
