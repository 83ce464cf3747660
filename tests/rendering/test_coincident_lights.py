"""Emitters in the same place as other surfaces light the scene as far as rays see them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from clrt.device.open import Device
from clrt.rendering.compile.lights.hidden_lights import hidden_lights
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import Camera, Mesh, RenderSettings, Scene, Sphere
from clrt.scene.render_settings import Integrator

from .pictures import film

pytestmark = pytest.mark.programs

FACES = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
BLACK = (0.0, 0.0, 0.0)
INTEGRATORS: tuple[Integrator, ...] = ("path", "local")


def quad(x: float, height: float, size: float, material: Diffuse) -> Mesh:
    """Return a square that faces down."""
    corners = np.array([[x, height, 0], [x + size, height, 0], [x + size, height, size], [x, height, size]], np.float32)
    return Mesh(corners, FACES, material)


def lamp(opacity: float = 1.0) -> Diffuse:
    return Diffuse(color=BLACK, emission=(1.0, 1.0, 1.0), opacity=opacity)


def received(device: Device, integrator: Integrator, meshes: list[Mesh], spheres: list[Sphere] | None = None) -> float:
    """Return the mean radiance of a grey floor below these emitters."""
    floor = Mesh(np.array([[-9, 0, 9], [9, 0, 9], [9, 0, -9], [-9, 0, -9]], np.float32), FACES, Diffuse())
    camera = Camera(position=(0.0, 0.4, 0.0), look_at=(0.2, 0.0, 0.1), fov_degrees=30.0)
    scene = Scene(
        meshes=[floor, *meshes],
        spheres=spheres or [],
        camera=camera,
        render=RenderSettings(size=(16, 16), max_depth=2, integrator=integrator),
    )
    return float(film(device, scene, 64).mean.mean())


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_copy_in_the_same_place_adds_nothing(device: Device, integrator: Integrator) -> None:
    """Rays find the first of the copies only."""
    flat, ball = quad(-0.3, 1.0, 2.0, lamp()), Sphere(center=(-1.0, 1.5, 0.0), radius=0.4, material=lamp())
    once = received(device, integrator, [flat], [ball])
    assert received(device, integrator, [flat] * 3, [ball] * 2) == pytest.approx(once, rel=1e-5)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_coincident_half_transparent_emitters(device: Device, integrator: Integrator) -> None:
    """n of them in one place emit 1 − 2⁻ⁿ of what an opaque one does, as seen by rays that cross them in order."""
    full = received(device, integrator, [quad(-0.3, 1.0, 2.0, lamp())])
    for count in (1, 2, 4):
        found = received(device, integrator, [quad(-0.3, 1.0, 2.0, lamp(0.5))] * count)
        assert found == pytest.approx((1 - 0.5**count) * full, rel=0.02)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_sheet_that_coincides_with_an_emitter(device: Device, integrator: Integrator) -> None:
    """It attenuates the light if rays cross it first: if it comes first in the scene."""
    sheet, emitter = quad(-0.3, 1.0, 2.0, Diffuse(color=BLACK, opacity=0.5)), quad(-0.3, 1.0, 2.0, lamp())
    full = received(device, integrator, [emitter])
    assert received(device, integrator, [sheet, emitter]) == pytest.approx(full / 2, rel=0.02)
    assert received(device, integrator, [emitter, sheet]) == pytest.approx(full, rel=0.02)


@given(
    st.lists(
        st.tuples(st.sampled_from([0.0, -0.0, 1.0, 1.0 + 2**-52]), st.sampled_from([0.0, 2.0]), st.booleans()),
        max_size=20,
    )
)
def test_hidden_by_an_earlier_one(rows: list[tuple[float, float, bool]]) -> None:
    shapes, opaque = np.array([row[:2] for row in rows]).reshape(-1, 2), np.array([row[2] for row in rows], bool)
    expected = [any(opaque[i] and (shapes[i] == shapes[j]).all() for i in range(j)) for j in range(len(rows))]
    assert hidden_lights(shapes, opaque).tolist() == expected
