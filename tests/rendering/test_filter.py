"""Pixel filters: the image of an edge is the filter's distribution function."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad as integral
from scipy.signal.windows import blackmanharris

from clrt.bench.significance import rejected
from clrt.device.open import Device
from clrt.rendering.compile.pixel_filters import CELLS, FILTERS, filter_quantiles
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import Camera, RenderSettings, Scene
from clrt.scene.render_settings import Filter

from .pictures import film, pixel_p_values, quad

DENSITIES = {
    "box": lambda t: float(abs(t) < 0.5),
    "tent": lambda t: max(0.0, 1 - abs(t)),
    "blackman_harris": lambda t: float(np.interp(t, np.linspace(-1.5, 1.5, 4097), blackmanharris(4097), 0, 0)),
    "gaussian": lambda t: max(0.0, float(np.exp(-2 * t * t) - np.exp(-8))),
}


def coverage(name: str, places: np.ndarray) -> np.ndarray:
    """Return the share of a filter centred at 0 that lies left of each place, in pixels."""

    def part(end: float) -> float:
        kinks = [p for p in (-1, -0.5, 0, 0.5, 1) if p < end]
        return float(integral(DENSITIES[name], -2, end, points=kinks, limit=200)[0])

    return np.array([part(place) for place in places]) / part(2)


@pytest.mark.parametrize("name", FILTERS)
def test_quantiles(name: str) -> None:
    """Each cell of the table holds the same share of the filter."""
    places = filter_quantiles(name)["quantile"].astype(np.float64) - 0.5
    assert np.allclose(coverage(name, places[::64]), np.arange(0, CELLS + 1, 64) / CELLS, atol=1e-5)


@pytest.mark.programs
@pytest.mark.parametrize("name", DENSITIES)
def test_an_edge_is_blurred_by_the_filter(device: Device, name: Filter) -> None:
    """An emissive wall ends at a third of a pixel: pixels near it see the share that their filters cover."""
    size, edge = 8, 4 + 1 / 3
    right, lamp = 2 * edge / size - 1, Diffuse(color=(0.0, 0.0, 0.0), emission=(1.0, 1.0, 1.0))
    wall = quad([(-9, -9, -1), (right, -9, -1), (right, 9, -1), (-9, 9, -1)], lamp)
    camera = Camera(position=(0.0, 0.0, 0.0), look_at=(0.0, 0.0, -1.0), fov_degrees=90)
    picture = film(
        device,
        Scene(
            meshes=[wall], camera=camera, render=RenderSettings(size=(size, size), spp=4096, max_depth=1, filter=name)
        ),
    )
    truth = np.broadcast_to(coverage(name, edge - (np.arange(size) + 0.5))[None, :, None], (size, size, 3))
    seen = (truth > 1e-3) & (truth < 1 - 1e-3)
    assert not rejected({str(i): p for i, p in enumerate(pixel_p_values(picture, truth)[seen][::3])})
    assert np.allclose(picture.mean[~seen], truth[~seen], atol=5e-3)
