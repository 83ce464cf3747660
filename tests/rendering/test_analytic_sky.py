"""Scenes under the analytic sky: the ground receives what sky and sun have, once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.significance import mean_test
from clrt.rendering.renderer import Renderer
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import Camera, Mesh, RenderSettings, Scene
from clrt.scene.sky.hosek_wilkie import SkyRadiance
from clrt.scene.sky.sky import Sky

from ..covering import others

if TYPE_CHECKING:
    from clrt.device.open import Device

ALBEDO, TURBIDITY = (0.4, 0.3, 0.2), 2.5


def irradiance_of_the_model(elevation: float) -> NDArray[np.float64]:
    """Return the irradiance (3,) of the ground by the sky without the sun, by Gauss–Legendre quadrature."""
    nodes, weights = np.polynomial.legendre.leggauss(100)
    height, weights = (nodes[:, None] + 1) / 2, weights / 2
    around = 2 * np.pi * (np.arange(200) + 0.5) / 200
    up = np.radians(elevation)
    from_sun = np.arccos(np.sqrt(1 - height**2) * np.cos(around) * np.cos(up) + height * np.sin(up))
    model = SkyRadiance(elevation, TURBIDITY, ALBEDO)
    values = model.at(np.broadcast_to(height, from_sun.shape), from_sun).mean(axis=1)
    return np.asarray(2 * np.pi * (weights * height[:, 0]) @ values)


@pytest.mark.parametrize("elevation", [8.0, *others(55.0)])
def test_a_plane_is_as_bright_as_the_ground_around_it(elevation: float, device: Device) -> None:
    """A diffuse plane under the sky against the quadrature of the map and the sun, and against the map's lower half."""
    up = np.radians(elevation)
    sky = Sky(sun_direction=(float(np.cos(up)), float(np.sin(up)), 0.0), turbidity=TURBIDITY, albedo=ALBEDO)
    corners = np.array([[-1, 0, -1], [-1, 0, 1], [1, 0, 1], [1, 0, -1]], np.float32)
    plane = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32), Diffuse(color=ALBEDO))
    scene = Scene(
        meshes=[plane],
        environment=sky.environment(),
        lights=sky.lights(),
        camera=Camera(position=(0, 3, 0), up=(0, 0, -1), projection="orthographic", view_height=1.0),
        render=RenderSettings(size=(32, 32), max_depth=2),
    )
    renderer = Renderer(scene, device=device.info.index, sampler="independent")
    film = list(renderer.passes(spp=64))[-1].film
    means = film.mean.reshape(-1, 3)
    image = sky.environment().image
    assert image is not None
    total = irradiance_of_the_model(elevation) + np.sin(up) * np.array(sky.irradiance)
    np.testing.assert_allclose(image[-1, 0], np.array(ALBEDO) / np.pi * total, rtol=2e-3)
    for channel in range(3):
        errors = means[:, channel] - image[-1, 0, channel]
        assert mean_test(errors.mean(), errors.var(ddof=1), len(errors), 0.0) > 1e-4
        assert errors.std() / np.sqrt(len(errors)) < 5e-3 * means[:, channel].mean()
