"""Conversion of scenes for Blender, as far as it can be tested without Blender."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clrt.bench.renderers.cycles_scene import BSDFS, check_scene, frame_of_axes, sphere_triangles, turned
from clrt.errors import UsageError
from clrt.scene.lights import PointLight, SpotLight
from clrt.scene.materials.material_types import MATERIALS, Material, MetallicRoughness
from clrt.scene.model import Camera, RenderSettings, Scene, Sphere


def ball(material: Material) -> Scene:
    return Scene(spheres=[Sphere(material=material, name="the ball")], name="room")


def test_skies_of_blender_are_ours_turned() -> None:
    """Blender's equirectangular u is 1/2 − atan2(y, x)/2π from the left, v acos(z)/π from the top."""
    directions = np.random.default_rng(1).normal(size=(100, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    (x, y, z), (bx, by, bz) = directions.T, turned(directions).T
    np.testing.assert_allclose((0.5 - np.arctan2(by, bx) / (2 * np.pi)) % 1, np.arctan2(x, -z) / (2 * np.pi) % 1)
    np.testing.assert_allclose(np.arccos(bz), np.arccos(y))


def test_frames_take_axes_and_origin_to_blenders_world() -> None:
    axes, origin = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]), np.array([4.0, 5, 6])
    frame = frame_of_axes(axes, origin)
    np.testing.assert_allclose(frame @ [1, 2, 3, 1], [*turned(origin + 1 * axes[0] + 2 * axes[1] + 3 * axes[2]), 1])
    assert np.linalg.det(frame) == pytest.approx(1)


def test_spheres_are_triangles_seen_from_outside() -> None:
    sphere = Sphere(center=(1, 2, 3), radius=0.5)
    vertices, faces, normals = sphere_triangles(sphere)
    np.testing.assert_allclose(vertices, sphere.center + 0.5 * normals.astype(np.float64), atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-6)
    a, b, c = vertices[faces].transpose(1, 0, 2)
    cross = np.cross(b - a, c - a)
    assert np.all(np.sum(cross * (a - sphere.center), axis=1) > 0)
    volume = np.sum(np.cross(a - sphere.center, b - sphere.center) * (c - sphere.center)) / 6
    assert volume == pytest.approx(4 / 3 * np.pi * 0.5**3, rel=1e-3)


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        (ball(MetallicRoughness(metallic=0.5)), "the ball: .*fully metallic"),
        (ball(MetallicRoughness(metallic=1.0, smith="separable")), "the ball: .*height_correlated"),
        (
            Scene(lights=[SpotLight(position=(0, 0, 0), direction=(0, 0, 1), intensity=(1, 1, 1))], name="room"),
            "room: ranges and spot lights",
        ),
        (Scene(lights=[PointLight(position=(0, 0, 0), intensity=(1, 1, 1), range=2)], name="room"), "room: ranges and"),
        (replace(ball(MATERIALS[0]()), camera=Camera(aperture_radius=0.1)), "room: .*only pinhole cameras"),
        (replace(ball(MATERIALS[0]()), render=RenderSettings(max_depth=1)), "room: .*max_depth of 2"),
        (
            replace(ball(MATERIALS[0]()), render=RenderSettings(back_face_culling="all")),
            "room: back_face_culling is not",
        ),
        (replace(ball(MATERIALS[0]()), render=RenderSettings(clamp_indirect=1.0)), "room: clamps .*out clamp_indirect"),
        (replace(ball(MATERIALS[0]()), render=RenderSettings(filter="tent")), 'room: .*filter = "box"'),
        (replace(ball(MATERIALS[0]()), render=RenderSettings(transparent=True)), "room: .*not exported to Cycles"),
    ],
)
def test_what_has_no_counterpart_is_refused_by_name(scene: Scene, words: str) -> None:
    with pytest.raises(UsageError, match=words):
        check_scene(scene)


def test_every_material_is_converted_or_refused() -> None:
    for kind in set(MATERIALS) - set(BSDFS):
        with pytest.raises(UsageError, match=f"the ball: .*{kind.kernel}"):
            check_scene(ball(kind()))
    for kind in set(BSDFS) - {MetallicRoughness}:
        check_scene(ball(kind()))
    check_scene(ball(MetallicRoughness(preset="gold", multiple_scattering=False)))
