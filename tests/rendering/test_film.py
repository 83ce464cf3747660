"""The accumulated picture: sums that never stall, samples that are no numbers, and a noise estimate that is right."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.device.open import Device
from clrt.rendering.film import RELATIVE_FLOOR, Film
from clrt.rendering.records import PIXEL
from clrt.scene.materials import Diffuse
from clrt.scene.model import Camera, Environment, RenderSettings, Scene, Sphere

from ..probe import Probe
from .pictures import box, film, quad

Doubles = NDArray[np.float64]


@pytest.fixture(scope="module")
def probe(device: Device) -> Probe:
    return Probe(device, Scene())


def accumulated(probe: Probe, radiance: Doubles, samples: int) -> Film:
    """A row of pixels, each with `samples` times its radiance (n, 3), as the kernels leave it."""
    out = probe("accumulate", 14, radiance, samples=samples)
    pixels = np.zeros((1, len(out)), PIXEL)
    for name, first in (("sum", 0), ("sum_error", 3), ("square", 6), ("square_error", 9)):
        pixels[name] = out[None, :, first:first + 3]
    pixels["count"], pixels["dropped"] = out[None, :, 12], out[None, :, 13]
    return Film(pixels)


def test_mean_holds_past_2_to_24_samples(probe: Probe) -> None:
    """2^25 + 8 samples of each radiance: a plain sum of floats stands still at 2^24 times the first."""
    samples = (1 << 25) + 8
    radiance = np.array([[1.0, 0.1, 1 + 2.0**-23], [1e6, 1e-6, 1e30], [1 / 3, 255.0, 3e-38]], np.float32).astype(float)
    picture = accumulated(probe, radiance, samples)
    assert np.all(picture.pixels["count"] == samples)
    np.testing.assert_allclose(picture.mean[0], radiance, rtol=1e-6)


def test_samples_that_are_no_numbers_are_dropped(probe: Probe) -> None:
    bad = np.array([[np.nan, 1, 1], [1, np.inf, 1], [1, 1, -np.inf], [1, 2, 3]])
    picture = accumulated(probe, bad, 5)
    assert picture.pixels["dropped"].tolist() == [[5, 5, 5, 0]]
    assert picture.pixels["count"].tolist() == [[0, 0, 0, 5]]
    assert picture.mean[0].tolist() == [[0, 0, 0], [0, 0, 0], [0, 0, 0], [1, 2, 3]]
    assert picture.nonfinite_samples == 15 and picture.samples == 20
    assert picture.noise is None


def test_sums_that_would_overflow(probe: Probe) -> None:
    """Finite samples whose sum is not: either the mean is right, or they are dropped and counted."""
    radiance = np.full((1, 3), 3e38, np.float32).astype(float)
    picture = accumulated(probe, radiance, 16)
    assert picture.samples == 16
    assert picture.nonfinite_samples == 16 or np.allclose(picture.mean[0], radiance, rtol=1e-6)


def test_overflowing_light_is_dropped_and_counted(device: Device) -> None:
    """Walls of the largest radiance that light each other: some sums overflow, and the picture stays finite."""
    lamp = Diffuse(color=(1.0, 1.0, 1.0), emission=(3e38, 3e38, 3e38))
    scene = Scene(meshes=[box(1.0, lamp)], camera=Camera(position=(0.0, 0.0, 0.0), look_at=(0.0, 0.1, 1.0)),
                  render=RenderSettings(size=(8, 8), spp=16, max_depth=3))
    picture = film(device, scene)
    assert picture.nonfinite_samples > 0
    assert picture.samples == 8 * 8 * 16
    assert np.isfinite(picture.mean).all()
    assert picture.noise is None or np.isfinite(picture.noise)


@pytest.mark.parametrize("spp", [16, 64])
def test_noise_is_the_error(device: Device, spp: int) -> None:
    """The estimated √relMSE beside the true one, in a box that shines alike everywhere.

    relMSE averages, over the pixels, squares of errors whose excess kurtosis is k: its relative variance is
    (2 + k)/pixels. That of the estimate, a mean of sample variances, is (2/(spp − 1) + k)/pixels, which is less.
    """
    albedo, emission = 0.5, 2.0
    walls = box(1.0, Diffuse(color=(albedo,) * 3, emission=(emission,) * 3))
    scene = Scene(meshes=[walls], camera=Camera(position=(0.1, 0.2, 0.3), look_at=(1.0, 0.5, 0.2), fov_degrees=90),
                  render=RenderSettings(size=(64, 64), spp=spp, max_depth=5, seed=3))
    picture, truth = film(device, scene), emission * (1 - albedo**5) / (1 - albedo)
    error = picture.mean[..., 0] - truth
    true_square = np.mean(error**2) / (truth**2 + RELATIVE_FLOOR)
    assert picture.noise is not None
    kurtosis = np.mean(error**4) / np.mean(error**2)**2 - 3
    spread = np.sqrt((2 + np.maximum(kurtosis, 0)) / error.size)
    assert abs(picture.noise**2 / true_square - 1) < 4 * np.sqrt(2) * spread


def test_noise_falls_with_the_root_of_the_samples(device: Device) -> None:
    lamp = quad([(-1, 2, -1), (1, 2, -1), (1, 2, 1), (-1, 2, 1)], Diffuse(emission=(5.0, 5.0, 5.0)))
    floor = quad([(-9, 0, 9), (9, 0, 9), (9, 0, -9), (-9, 0, -9)], Diffuse())
    camera = Camera(position=(0.0, 3.0, 8.0), look_at=(0.0, 0.0, 0.0), fov_degrees=30)
    noises = []
    for spp in (16, 256):
        scene = Scene(meshes=[lamp, floor], spheres=[Sphere(radius=0.3)], camera=camera,
                      environment=Environment(color=(0.1, 0.1, 0.1)),
                      render=RenderSettings(size=(48, 48), spp=spp, max_depth=3))
        noises.append(film(device, scene).noise)
    assert noises[0] and noises[1] and 3.2 < noises[0] / noises[1] < 4.8   # 4, within a fifth


def test_counts_and_rays(device: Device) -> None:
    """A picture of the sky alone: one ray a sample."""
    scene = Scene(environment=Environment(color=(1.0, 1.0, 1.0)), render=RenderSettings(size=(30, 7), spp=9))
    picture = film(device, scene)
    assert np.all(picture.pixels["count"] == 9)
    assert picture.samples == picture.rays == 30 * 7 * 9
