"""Environment maps: look-up by the convention, sampling by luminance, and radiance against a quadrature."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.kernel_probe import Probe
from clrt.bench.significance import chi2_test, mean_test, sidak
from clrt.device.open import Device
from clrt.scene.model import Environment, Scene

from . import skies

pytestmark = pytest.mark.statistics

Doubles = NDArray[np.float64]
COUNT, FAMILY = 1 << 19, 1e-3
HEIGHT, WIDTH = 16, 32
UP = np.array([0.0, 1.0, 0.0])


def gradient() -> NDArray[np.float32]:
    """Return an image that is much brighter downwards and varies around, differently per channel."""
    v, u = np.meshgrid((np.arange(HEIGHT) + 0.5) / HEIGHT, (np.arange(WIDTH) + 0.5) / WIDTH, indexing="ij")
    bright = 0.1 + v**3 * (1.5 + np.sin(2 * np.pi * u)) ** 2
    return np.stack([bright, 2 * bright, bright * (1.2 + np.cos(2 * np.pi * u))], axis=-1).astype(np.float32)


def smooth() -> NDArray[np.float32]:
    """Without small bright parts."""
    v, u = np.meshgrid((np.arange(HEIGHT) + 0.5) / HEIGHT, (np.arange(WIDTH) + 0.5) / WIDTH, indexing="ij")
    return np.stack([0.1 + v, 1.5 + np.sin(2 * np.pi * u), 1.2 + v * np.cos(2 * np.pi * u)], axis=-1).astype(np.float32)


def sun() -> NDArray[np.float32]:
    """Return an image with one texel of 1e5 in uneven haze."""
    image = np.random.default_rng(1).uniform(0.5, 1.5, (HEIGHT, WIDTH, 3)).astype(np.float32)
    image[4, 20] = 1e5
    return image


def low_sun() -> NDArray[np.float32]:
    """A blue sky over dark ground, and a texel that adds a tenth to their light: under a third is above the mean."""
    image = np.repeat(np.array([[0.3, 0.5, 1.0], [0.15, 0.12, 0.1]], np.float32), HEIGHT // 2, axis=0)[:, None]
    image = np.tile(image, (1, WIDTH, 1))
    image[3, 20] += 20
    return image


def texel(values: tuple[float, float, float]) -> NDArray[np.float32]:
    return np.array([[values]], np.float32)


SKIES = {
    "gradient": (gradient(), 0.0),
    "turned": (gradient(), 77.0),
    "sun": (sun(), -130.0),
    "low_sun": (low_sun(), 0.0),
    "smooth": (smooth(), 30.0),
    "one_texel": (texel((0.5, 1.0, 2.0)), 10.0),
}
#: Those that are left to the surfaces' own directions.
EVEN = ("smooth", "one_texel")


@pytest.fixture(scope="module", params=SKIES)
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def probe(device: Device, name: str) -> Probe:
    image, rotation = SKIES[name]
    return Probe(device, Scene(environment=Environment(image=image, rotation_degrees=rotation)))


def seen(probe: Probe, w: Doubles) -> Doubles:
    """Return radiance from directions (n, 3) and the pdf of light sampling for them, (n, 4)."""
    return probe("sky", 4, np.zeros_like(w), np.tile([0.0, 1.0, 0.0], (len(w), 1)), w)


def sampled(probe: Probe, normal: Doubles, seed: int) -> Doubles:
    """Return probe_light_sample's output (COUNT, 12)."""
    return probe("light_sample", 12, np.zeros((COUNT, 3)), np.tile(normal, (COUNT, 1)), seed=seed)


def directions(count: int) -> Doubles:
    """Return random unit vectors, both poles, and both sides of the seam and of the axes."""
    w = np.random.default_rng(2).normal(size=(count, 3))
    w /= np.linalg.norm(w, axis=1, keepdims=True)
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    seam = np.array([[x, y, -np.sqrt(1 - y * y)] for x in (0.0, -0.0, 1e-6, -1e-6) for y in (-0.7, 0.0, 0.9)])
    return np.concatenate([w, axes, seam]).astype(np.float32).astype(np.float64)


def test_radiance_follows_the_convention(probe: Probe, name: str) -> None:
    """Angles are off by 4e-7 at most (atan2 of OpenCL: 6 ulp), which changes radiance by the image's steepest step."""
    image, rotation = SKIES[name]
    w = directions(100_000)
    found = seen(probe, w)[:, :3]
    steps = [
        np.abs(np.diff(image.astype(np.float64), axis=axis, append=image.take([0], axis=axis))).max(initial=0)
        for axis in (0, 1)
    ]
    # Near the poles the azimuth's uncertainty is the direction's last digits over its sine.
    blur = 4e-7 * np.maximum(1, 0.1 / np.maximum(np.hypot(w[:, 0], w[:, 2]), 1e-30))
    tolerance = blur * max(steps) * 2 * WIDTH + 1e-6 * image.max()
    smooth = np.hypot(w[:, 0], w[:, 2]) > 1e-5  # at a pole any azimuth is right
    error = np.abs(found - skies.lookup(image, w, rotation)).max(axis=1)
    assert np.all(error[smooth] <= tolerance[smooth])
    assert np.isfinite(found).all()


def test_density_integrates_to_one(probe: Probe, name: str) -> None:
    """∫ pdf dω by the midpoint rule with 8 by 8 points per texel, in which pdf·sin θ is constant."""
    v, u = np.meshgrid(
        (np.arange(8 * HEIGHT) + 0.5) / (8 * HEIGHT), (np.arange(8 * WIDTH) + 0.5) / (8 * WIDTH), indexing="ij"
    )
    pdf = seen(probe, skies.from_uv(u.ravel(), v.ravel()))[:, 3]
    integral = np.sum(pdf * np.sin(np.pi * v.ravel())) * 2 * np.pi**2 / v.size
    # If the image is rotated, points on texel edges round to either side.
    assert abs(integral - (name not in EVEN)) < 2e-6 * WIDTH


def test_even_skies_are_not_sampled(probe: Probe, name: str) -> None:
    assert ("LIGHT_SKY" in probe.compiled.features) == (name not in EVEN)
    assert ("sky_steps" in probe.compiled.buffers) == (name not in EVEN)


@pytest.mark.parametrize("name", sorted(SKIES.keys() - EVEN), indirect=True)
def test_samples_follow_the_density(probe: Probe, name: str) -> None:
    """Chi-square over the texels; each sample reports the pdf and radiance of its direction."""
    image, rotation = SKIES[name]
    height, width = image.shape[:2]
    sample = sampled(probe, UP, seed=3)
    u, v = skies.to_uv(skies.turned(sample[:, :3], -rotation))
    cell = np.minimum((v * height).astype(int), height - 1) * width + np.minimum((u * width).astype(int), width - 1)
    density = probe.compiled.buffers["sky_texels"][1]["density"].astype(np.float64)
    found = np.bincount(cell, minlength=density.size)
    edges = np.bincount(cell[density[cell] == 0], minlength=density.size)  # rounded to the other side of an edge
    assert edges.sum() < 1e-5 * COUNT
    assert chi2_test(found - edges, density / density.sum() * (COUNT - edges.sum())) > 1e-4

    looked_up = seen(probe, sample[:, :3])
    inside = np.all([np.abs(x * size % 1 - 0.5) < 0.499 for x, size in ((u, width), (v, height))], axis=0)
    inside &= np.hypot(sample[:, 0], sample[:, 2]) > 0.01
    np.testing.assert_allclose(looked_up[inside, 3], sample[inside, 6], rtol=2e-5)
    np.testing.assert_allclose(looked_up[inside, :3], sample[inside, 3:6], rtol=1e-3, atol=1e-5 * image.max())


@pytest.mark.parametrize("name", sorted(SKIES.keys() - EVEN), indirect=True)
def test_what_is_brighter_than_the_mean_is_sampled(probe: Probe, name: str) -> None:
    """Texels with less than the mean luminance are not sampled, the others in proportion to their excess."""
    image, rotation = SKIES[name]
    height, width = image.shape[:2]
    steps = 24
    v, u = np.meshgrid(
        (np.arange(height * steps) + 0.5) / (height * steps),
        (np.arange(width * steps) + 0.5) / (width * steps),
        indexing="ij",
    )
    light = skies.lookup(image, skies.from_uv(u.ravel(), v.ravel())) @ [0.2126, 0.7152, 0.0722]
    texels = light.reshape(height, steps, width, steps).mean(axis=(1, 3))
    angle = -np.diff(np.cos(np.pi * np.arange(height + 1) / height))[:, None] * np.ones((1, width))
    expected = np.maximum(texels - np.average(texels, weights=angle), 0) * angle
    density = probe.compiled.buffers["sky_texels"][1]["density"].reshape(height, width)
    np.testing.assert_allclose(density / density.sum(), expected / expected.sum(), atol=2e-4)


@pytest.mark.parametrize("name", sorted(SKIES.keys() - EVEN), indirect=True)
def test_irradiance(probe: Probe, name: str) -> None:
    """The samples' mean of radiance·cos/pdf against a float64 quadrature over the sampled texels."""
    image, rotation = SKIES[name]
    normals = np.array([[0.0, 1.0, 0.0], [0.6, 0.0, -0.8], [-0.48, -0.6, 0.64]])
    where = probe.compiled.buffers["sky_texels"][1]["density"].reshape(image.shape[:2]) > 0
    p_values = []
    for seed, normal in enumerate(normals):
        sample = sampled(probe, normal, seed)
        values = sample[:, 3:6] * (np.maximum(sample[:, :3] @ normal, 0) / sample[:, 6])[:, None]
        expected = skies.irradiance(image, normal, rotation, where=where)
        variance = values.var(axis=0) + COUNT * (3e-5 * expected) ** 2  # including the quadrature's own error
        p_values.append(mean_test(values.mean(axis=0), variance, COUNT, expected))
    assert np.min(p_values) > sidak(FAMILY, np.size(p_values))


def test_constant_sky(device: Device) -> None:
    """It is the same from everywhere, and left to BSDF sampling."""
    probe = Probe(device, Scene(environment=Environment(color=(0.5, 0.25, 2.0), strength=3.0)))
    out = seen(probe, directions(100))
    assert np.all(out == [1.5, 0.75, 6.0, 0.0])
    assert probe.compiled.counts["lights"] == 0


def test_black_sky_is_left_out(device: Device) -> None:
    for black in (
        Environment(),
        Environment(image=np.zeros((2, 4, 3), np.float32)),
        Environment(color=(1.0, 1.0, 1.0), strength=0.0),
    ):
        assert "SKY" not in Probe(device, Scene(environment=black)).compiled.features
