"""Packs the sky: its radiance, and for a picture with bright parts the table by which directions to them are drawn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene.model import Environment
from .records import ENVIRONMENT, SKY_TEXEL
from .steps import steps

Doubles = NDArray[np.float64]
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
#: A sky is sampled if more than this part of its light is above its mean. Of the default sky it is 0.31.
UNEVEN = 1 / 3
#: Of the irradiance from all around, at most what may depend on the direction, so that no surface is taken for dark.
MOST_DIRECTED = 0.9


@dataclass(frozen=True)
class Sky:
    """What the kernels get of the environment: a file (None: a black sky) and buffers.

    irradiance: of what is sampled, about (luminance): a scalar and a vector, (4,), for a normal n scalar + n·vector;
    None where the sky is left to the surfaces' own directions.
    """

    kernel: str | None
    buffers: dict[str, tuple[str, NDArray[Any]]]
    irradiance: Doubles | None = None


def pack_sky(environment: Environment) -> Sky:
    """The sky of an Environment.

    What is sampled is the light above the sky's mean: the rest comes from everywhere alike, and for that directions
    drawn from the surface are never worse (Karlík et al. 2019, "MIS Compensation"). So a constant sky is not sampled,
    and neither is a smooth one, where shadow rays cost more than they save.
    """
    record = np.zeros(1, ENVIRONMENT)
    image = environment.image
    if image is None:
        color = np.asarray(environment.color) * environment.strength
        record["color"] = color
        return Sky("light/constant_sky.cl", {"environment": ("Environment", record)}) if color.any() else Sky(None, {})
    radiance = image.astype(np.float64) * environment.strength
    if not radiance.any():
        return Sky(None, {})
    height, width = radiance.shape[:2]
    angle = np.radians(environment.rotation_degrees)
    record["width"], record["height"] = width, height
    record["rotation_cos"], record["rotation_sin"] = np.cos(angle), np.sin(angle)
    texels = np.zeros(width * height, SKY_TEXEL)
    texels["radiance"] = radiance.reshape(-1, 3)
    buffers: dict[str, tuple[str, NDArray[Any]]] = {
        "environment": ("Environment", record), "sky_texels": ("SkyTexel", texels)}
    mean, solid_angle = _texel_means(radiance @ LUMINANCE), _solid_angles(height, width)
    total = np.sum(mean * solid_angle)
    weights = np.maximum(mean - total / (4 * np.pi), 0) * solid_angle
    if weights.sum() <= UNEVEN * total:
        return Sky("light/image_sky.cl", buffers)
    columns, in_row = steps(np.where(weights.any(axis=1, keepdims=True), weights, 1.0))
    rows, of_rows = steps(weights.sum(axis=1))
    texels["density"] = (of_rows[:, None] * in_row).ravel() * (width * height)
    buffers["sky_steps"] = ("SkyStep", np.concatenate([columns.ravel(), rows]))
    return Sky("light/image_sky.cl", buffers, _irradiance(weights, angle))


def _texel_means(luminance: Doubles) -> Doubles:
    """(h, w): mean of the bilinear luminance over each texel.

    Between texel centres the bilinear weights average to 1/8, 3/4, 1/8 over a texel, in each direction.
    """
    rows = 0.75 * luminance + 0.125 * (np.roll(luminance, 1, axis=1) + np.roll(luminance, -1, axis=1))
    padded = np.pad(rows, ((1, 1), (0, 0)), mode="edge")
    return np.asarray(0.75 * rows + 0.125 * (padded[:-2] + padded[2:]))


def _solid_angles(height: int, width: int) -> Doubles:
    """(h, 1): of a texel of each row."""
    edges = np.cos(np.pi * np.arange(height + 1) / height)
    return np.asarray((edges[:-1] - edges[1:])[:, None] * (2 * np.pi / width))


def _irradiance(weights: Doubles, angle: float) -> Doubles:
    """(4,): see Sky. The first two bands of spherical harmonics (Ramamoorthi and Hanrahan 2001), kept positive.

    weights: (h, w), radiance times solid angle; angle: by which the picture is turned.
    """
    height, width = weights.shape
    theta = np.pi * (np.arange(height) + 0.5) / height
    phi = 2 * np.pi * (np.arange(width) + 0.5) / width - angle
    rows, columns = weights.sum(axis=1), np.sin(theta) @ weights
    vector = np.array([columns @ np.sin(phi), rows @ np.cos(theta), -columns @ np.cos(phi)]) / 2
    scalar = rows.sum() / 4
    return np.append(scalar, vector * min(1.0, MOST_DIRECTED * scalar / max(np.linalg.norm(vector), 1e-300)))
