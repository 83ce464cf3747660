"""Samplers: points fill the square as theory predicts, and pixels and dimensions are independent."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.stats import chi2, pearsonr, qmc

from clrt.bench.kernel_probe import Doubles, Probe
from clrt.bench.significance import FAMILY, chi2_test, mean_test, rejected
from clrt.device.open import Device
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import Camera, RenderSettings, Scene, Sphere
from clrt.scene.render_settings import Sampler

from .pictures import film, quad

pytestmark = pytest.mark.statistics

SAMPLERS: tuple[Sampler, ...] = ("sobol", "stratified", "independent")


def probe_of(device: Device, sampler: Sampler, **chosen: Any) -> Probe:
    return Probe(device, Scene(render=RenderSettings(sampler=sampler)), **chosen)


def draw(
    probe: Probe, pixel: ArrayLike, sample: ArrayLike, dimension: int = 0, seed: int = 0, block_bits: int = 32
) -> Doubles:
    """Return the numbers (n, 2) of pixels and samples, which broadcast."""
    p, s = np.broadcast_arrays(np.asarray(pixel, np.int64), np.asarray(sample, np.int64))
    return probe(
        "random",
        2,
        p.ravel() >> 16,
        p.ravel() & 0xFFFF,
        s.ravel() >> 16,
        s.ravel() & 0xFFFF,
        seed=seed,
        dimension=dimension,
        block_bits=block_bits,
    )


@pytest.fixture(scope="module")
def sobol(device: Device) -> Probe:
    return probe_of(device, "sobol")


def fills_all_boxes(points: Doubles) -> bool:
    """Return whether 2^m points are a (0, m, 2)-net: one in each box of area 2^-m with power-of-two sides."""
    bits = len(points).bit_length() - 1
    return all(
        len(np.unique((points * [1 << a, 1 << (bits - a)]).astype(int) @ [1 << bits, 1])) == len(points)
        for a in range(bits + 1)
    )


@pytest.mark.parametrize("bits", [1, 2, 5, 10])
def test_sobol_samples_are_nets(sobol: Probe, bits: int) -> None:
    """2^k samples from any multiple of 2^k on are a net, in every pair of dimensions."""
    for pixel, dimension in ((0, 0), (5, 1), (123456789, 7)):
        for start in (0, 3 << bits, (1 << 24) - (1 << bits)):
            assert fills_all_boxes(draw(sobol, pixel, start + np.arange(1 << bits), dimension))


@pytest.mark.parametrize("block_bits, side_bits", [(0, 3), (2, 2), (4, 3), (6, 1)])
def test_neighbours_fill_the_square_together(sobol: Probe, block_bits: int, side_bits: int) -> None:
    """The blocks of an aligned square of pixels form one net, anywhere on the Z curve."""
    pixels = np.arange(1 << 2 * side_bits)[:, None] + (37 << 2 * side_bits)
    assert fills_all_boxes(draw(sobol, pixels, np.arange(1 << block_bits), 2, block_bits=block_bits))


def test_errors_of_squares_know_nothing_of_each_other(sobol: Probe) -> None:
    """The error of a sequence for an integral, here ∫∫ xy, is random: over 128 seeds the mean squared errors of two
    neighbouring squares of 16 pixels, 16 samples each, do not correlate. Within a square they do, even in its halves.
    """
    n, square, seeds = 16, 256, 128
    pixels = np.arange(2 * square)[:, None]
    points = [draw(sobol, pixels, np.arange(n), seed=seed, block_bits=4) for seed in range(seeds)]
    error = np.array([each.prod(axis=1).reshape(2, square, n).mean(axis=2) - 0.25 for each in points])
    halves = (error**2).reshape(seeds, 4, square // 2).mean(axis=2)
    assert pearsonr(halves[:, 0], halves[:, 1]).pvalue < FAMILY
    assert pearsonr(halves[:, :2].mean(axis=1), halves[:, 2:].mean(axis=1)).pvalue > FAMILY


@pytest.mark.parametrize("sampler, power", [("sobol", 3), ("independent", 1)])
def test_error_of_a_mean_falls_as_theory_says(device: Device, sampler: Sampler, power: int) -> None:
    """A mean of x over n points, one in each n-th of [0, 1), has the variance 1/(12n³); independent: 1/(12n)."""
    pixels, probe = 2048, probe_of(device, sampler)
    for bits in (0, 3, 6):
        n = 1 << bits
        means = draw(probe, np.arange(pixels)[:, None], np.arange(n)).reshape(pixels, n, 2).mean(axis=1)
        squares = ((means - 0.5) ** 2).sum(axis=0) * 12 * float(n) ** power
        assert np.all(2 * chi2.sf(np.maximum(squares, 2 * pixels - squares), pixels) > FAMILY / 12)


def test_sobol_scrambling_is_as_good_as_scipys(sobol: Probe) -> None:
    """The mean squared errors of ∫∫ xy and of an edge over 32 points equal those of scipy's scrambled Sobol' points."""
    n, pixels = 32, 2048
    ours = draw(sobol, np.arange(pixels)[:, None], np.arange(n), 3).reshape(pixels, n, 2)
    theirs = np.stack([qmc.Sobol(2, rng=seed).random(n) for seed in range(pixels)])

    def squares(points: Doubles) -> Doubles:
        x, y = points[..., 0], points[..., 1]
        return np.stack([((x * y).mean(axis=1) - 0.25) ** 2, ((x + y < 1).mean(axis=1) - 0.5) ** 2])

    a, b = squares(ours), squares(theirs)
    z = (a.mean(axis=1) - b.mean(axis=1)) / np.sqrt((a.var(axis=1) + b.var(axis=1)) / pixels)
    assert np.all(np.abs(z) < 4)


@pytest.mark.parametrize("block_bits", [1, 4, 7, 10])
def test_stratified_samples_lie_one_in_each_cell(device: Device, block_bits: int) -> None:
    probe, n = probe_of(device, "stratified"), 1 << block_bits
    columns, rows = 1 << block_bits // 2, 1 << block_bits - block_bits // 2
    for pixel, start in ((0, 0), (77, 5 * n)):
        cells = (draw(probe, pixel, start + np.arange(n), 1, block_bits=block_bits) * [columns, rows]).astype(int)
        assert len(np.unique(cells @ [rows, 1])) == n


@pytest.mark.parametrize("sampler", SAMPLERS)
def test_pixels_dimensions_and_seeds_are_unrelated(device: Device, sampler: Sampler) -> None:
    """One sample of many pixels is uniform, and independent of another dimension, seed or neighbouring pixel, and in
    its two components, for samples without an order of their own."""
    probe, count, p_values = probe_of(device, sampler), 1 << 15, {}
    pixels = 7 * (1 << 20) + np.arange(count)
    for sample in (0, 5):
        first = draw(probe, pixels, sample, 4, 9)
        others = {
            "dimension": draw(probe, pixels, sample, 5, 9),
            "far": draw(probe, pixels, sample, 4 + 256, 9),
            "seed": draw(probe, pixels, sample, 4, 10),
            "neighbour": draw(probe, pixels + 1, sample, 4, 9),
            "itself": first[:, ::-1],
        }
        for name, other in others.items():
            for axis in (0, 1):
                cells = (first[:, axis] * 16).astype(int) * 16 + (other[:, axis] * 16).astype(int)
                counts = np.bincount(cells, minlength=256)
                p_values[f"{name} {axis} of {sample}"] = chi2_test(counts, np.full(256, count / 256))
    assert not rejected(p_values)


@pytest.mark.parametrize("sampler", SAMPLERS)
@pytest.mark.parametrize("spp", [1, 4, 13])
def test_pictures_are_unbiased(device: Device, sampler: Sampler, spp: int) -> None:
    """A sphere light on a floor, L = ρ·L·r²·cos θ/d² with cos θ = h/d (no bounce): over 64 seeds the images' means have
    the mean of a float64 quadrature."""
    albedo, radiance, radius, height = 0.5, 40.0, 0.1, 2.0
    floor = quad([(-9, 0, 9), (9, 0, 9), (9, 0, -9), (-9, 0, -9)], Diffuse(color=(albedo,) * 3))
    lamp = Sphere(center=(0, height, 0), radius=radius, material=Diffuse(color=(0, 0, 0), emission=(radiance,) * 3))
    camera = Camera(position=(0.0, 1.0, 0.0), look_at=(0.0, 0.0, 0.0), up=(0.0, 0.0, -1.0), fov_degrees=90)
    place = (np.arange(512) + 0.5) / 256 - 1
    d2 = place[:, None] ** 2 + place**2 + height**2
    truth = float(np.mean(albedo * radiance * radius**2 * height / d2**1.5))
    means = [
        film(
            device,
            Scene(
                meshes=[floor],
                spheres=[lamp],
                camera=camera,
                render=RenderSettings(size=(8, 8), spp=spp, max_depth=2, seed=seed),
            ),
            sampler=sampler,
        ).mean.mean()
        for seed in range(64)
    ]
    assert mean_test(float(np.mean(means)), float(np.var(means, ddof=1)) + (1e-6 * truth) ** 2, 64, truth) > FAMILY
