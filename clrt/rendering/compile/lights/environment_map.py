"""Packing of the environment: its radiance, and the sampling table of environment maps with bright regions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....scene.model import Environment
from ...film.row_bands import bands_of
from ..records import ENVIRONMENT, SKY_STEP, SKY_TEXEL
from .piecewise_constant import steps

Doubles = NDArray[np.float64]
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
#: An environment map is sampled as a light if the third central moment of its luminance over all directions, in cubes
#: of the mean, is more than this. The moment is large for small bright parts, even if they hold little of the light,
#: and small for gradients and half-bright maps, which do not gain from it. For the default sky it is 0.04.
UNEVEN = 0.15
#: Maximum directional fraction of the irradiance estimate, so that no surface is considered dark.
MOST_DIRECTED = 0.9


@dataclass(frozen=True)
class EnvironmentMap:
    """The environment for the kernels: a kernel file (None for a black sky) and buffers.

    irradiance: approximate irradiance (luminance) due to the sampled part: a scalar and a vector, (4,), meaning scalar
    + n·vector for a normal n; None if the sky is left to BSDF sampling.
    """

    kernel: str | None
    buffers: dict[str, tuple[str, NDArray[Any]]]
    irradiance: Doubles | None = None


def pack_sky(environment: Environment) -> EnvironmentMap:
    """Pack the sky of an Environment.

    Only the radiance above the mean is sampled: the rest arrives uniformly from all directions, for which BSDF sampling
    is never worse (Karlík et al. 2019, "MIS Compensation"). Hence constant skies are not sampled, and neither are
    smooth ones, for which shadow rays cost more than they save.
    """
    record = np.zeros(1, ENVIRONMENT)
    image = environment.image
    if image is None:
        color = np.asarray(environment.color) * environment.strength
        record["color"] = color
        if not color.any():
            return EnvironmentMap(None, {})
        return EnvironmentMap("light/constant_sky.cl", {"environment": ("Environment", record)})
    if not image.any() or not environment.strength:
        return EnvironmentMap(None, {})
    height, width = image.shape[:2]
    angle = np.radians(environment.rotation_degrees)
    record["width"], record["height"] = width, height
    record["rotation_cos"], record["rotation_sin"] = np.cos(angle), np.sin(angle)
    texels = np.zeros((height, width), SKY_TEXEL)
    mean = _fill_radiance(texels, image, environment.strength)
    buffers: dict[str, tuple[str, NDArray[Any]]] = {
        "environment": ("Environment", record),
        "sky_texels": ("SkyTexel", texels.ravel()),
    }
    solid_angle = _solid_angles(height, width)
    total = np.sum(mean * solid_angle)
    overall = total / (4 * np.pi)
    mean -= overall
    moment = np.einsum("hw,hw,hw,h", mean, mean, mean, solid_angle[:, 0]) / (4 * np.pi)
    if moment <= UNEVEN * overall**3:
        return EnvironmentMap("light/image_sky.cl", buffers)
    weights = np.maximum(mean, 0, out=mean)
    weights *= solid_angle
    of_rows = weights.sum(axis=1)
    irradiance = _irradiance(weights, angle)
    weights[of_rows == 0] = 1  # never sampled
    table = np.empty(height * width + height, SKY_STEP)
    density = steps(weights, table[: height * width].reshape(height, width))
    density *= steps(of_rows[None], table[height * width :][None]).T
    texels["density"] = density * (width * height)
    buffers["sky_steps"] = ("SkyStep", table)
    return EnvironmentMap("light/image_sky.cl", buffers, irradiance)


def _fill_radiance(texels: NDArray[np.void], image: NDArray[np.float32], strength: float) -> Doubles:
    """Fill in the texels' radiance, and return (h, w): the mean of the bilinear luminance over each texel.

    Between texel centres the bilinear weights average to 1/8, 3/4, 1/8 over a texel, in each direction.
    """
    height, width = texels.shape
    across = np.empty((height, width))
    for rows in bands_of(across.shape):
        radiance = image[rows].astype(np.float64) * strength
        texels["radiance"][rows] = radiance
        luminance = radiance @ LUMINANCE
        across[rows] = 0.75 * luminance + 0.125 * (np.roll(luminance, 1, axis=1) + np.roll(luminance, -1, axis=1))
    mean = np.empty((height, width))
    for rows in bands_of(across.shape):
        near = across[np.arange(rows.start - 1, rows.stop + 1).clip(0, height - 1)]
        mean[rows] = 0.75 * near[1:-1] + 0.125 * (near[:-2] + near[2:])
    return mean


def _solid_angles(height: int, width: int) -> Doubles:
    """Return (h, 1), the solid angle of a texel in each row."""
    edges = np.cos(np.pi * np.arange(height + 1) / height)
    return np.asarray((edges[:-1] - edges[1:])[:, None] * (2 * np.pi / width))


def _irradiance(weights: Doubles, angle: float) -> Doubles:
    """Return (4,), see Sky: the first two bands of spherical harmonics (Ramamoorthi and Hanrahan 2001), kept positive.

    weights: (h, w), radiance times solid angle; angle: rotation of the image.
    """
    height, width = weights.shape
    theta = np.pi * (np.arange(height) + 0.5) / height
    phi = 2 * np.pi * (np.arange(width) + 0.5) / width - angle
    rows, columns = weights.sum(axis=1), np.sin(theta) @ weights
    vector = np.array([columns @ np.sin(phi), rows @ np.cos(theta), -columns @ np.cos(phi)]) / 2
    scalar = rows.sum() / 4
    return np.append(scalar, vector * min(1.0, MOST_DIRECTED * scalar / max(np.linalg.norm(vector), 1e-300)))
