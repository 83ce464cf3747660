"""Two emissive triangles that form a parallelogram are one light. (Their irradiance: test_lights.py.)"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clrt.bench.kernel_probe import choices
from clrt.device.open import Device
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.materials.textures import WHITE, Texture
from clrt.scene.model import Mesh, Scene

pytestmark = pytest.mark.statistics

LAMP = Diffuse(emission=(1.0, 1.0, 1.0))


@pytest.mark.parametrize(
    ("corners", "joined"),
    [
        ([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], True),
        ([(0, 0, 0), (2, 0, 0), (3, 1, 1), (1, 1, 1)], True),
        ([(0.1, 0.7, 0.3), (1.4, 0.7, 0.3), (1.4, 2.3, 0.3), (0.1, 2.3, 0.3)], True),
        ([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 2, 0)], False),
        ([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0.01)], False),
    ],
)
def test_two_triangles_of_a_parallelogram_are_one_light(
    device: Device, corners: list[tuple[float, float, float]], joined: bool
) -> None:
    """For any numbering of its faces, but not across meshes, nor if one is flipped."""
    for diagonal in (0, 1):
        for turn in np.ndindex(3, 3):
            quad_corners = np.roll(np.array(corners, np.float32), -diagonal, axis=0)
            faces = np.array([np.roll([0, 1, 2], turn[0]), np.roll([0, 2, 3], turn[1])], np.int32)
            mesh = Mesh(quad_corners, faces, LAMP)
            assert light_count(device, [mesh]) == 2 - joined
    assert light_count(device, [mesh, replace(mesh, vertices=mesh.vertices + np.float32(5))]) == 2 * (2 - joined)
    assert light_count(device, [replace(mesh, faces=faces[:1]), replace(mesh, faces=faces[1:])]) == 2
    assert light_count(device, [replace(mesh, faces=np.array([faces[0], faces[1, ::-1]]))]) == 2


def test_a_parallelogram_that_fades_is_two_lights(device: Device) -> None:
    """By a picture or the alpha of its corners."""
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], np.float32)
    mesh = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32), LAMP, uv=corners[:, :2])
    colors = np.array([[1, 1, 1, alpha] for alpha in (0, 1, 1, 0)], np.float32)
    assert light_count(device, [replace(mesh, material=replace(LAMP, opacity=Texture(picture=WHITE)))]) == 2
    assert light_count(device, [replace(mesh, colors=colors, material=replace(LAMP, opacity=0.5))]) == 2
    assert light_count(device, [replace(mesh, colors=colors)]) == 2
    assert light_count(device, [replace(mesh, material=replace(LAMP, opacity=0.5))]) == 1


def light_count(device: Device, meshes: list[Mesh]) -> int:
    return int(compile_scene(Scene(meshes=meshes), choices(device)).counts["lights"][0])


def test_a_strip_of_squares_makes_pairs(device: Device) -> None:
    """Each square of two triangles is a pair, although neighbours of different squares form a parallelogram, too."""
    x, y = np.meshgrid(np.arange(6.0), np.arange(2.0))
    vertices = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1).astype(np.float32)
    faces = np.array([face for i in range(5) for face in ((i, i + 1, i + 6), (i + 1, i + 7, i + 6))], np.int32)
    assert light_count(device, [Mesh(vertices, faces, LAMP)]) == 5
