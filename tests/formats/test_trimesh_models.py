"""Meshes and scenes of trimesh: as the files that trimesh writes of them, and as its own ray engine sees them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

import clrt
from clrt.errors import SceneError, UsageError


def scene() -> trimesh.Scene:
    """Return a scene of two meshes, one of them twice, moved and scaled, and a colored one."""
    ball, box = trimesh.creation.icosphere(subdivisions=2), trimesh.creation.box((1, 2, 3))
    box.visual = trimesh.visual.TextureVisuals(
        material=trimesh.visual.material.PBRMaterial(baseColorFactor=[255, 0, 0, 255], metallicFactor=0.0)
    )
    made = trimesh.Scene()
    made.add_geometry(ball, geom_name="ball", node_name="first")
    made.graph.update("second", matrix=trimesh.transformations.translation_matrix((3, 0, 0)), geometry="ball")
    made.add_geometry(box, transform=trimesh.transformations.rotation_matrix(0.5, (0, 1, 0), (0, 0, 4)))
    return made


def triangles(loaded: clrt.Scene) -> int:
    return sum(len(mesh.faces) for mesh in loaded.meshes) + sum(len(each.mesh.faces) for each in loaded.instances)


def test_a_scene_is_that_of_its_file(tmp_path: Path) -> None:
    made = scene()
    (tmp_path / "a.glb").write_bytes(made.export(file_type="glb"))
    loaded, expected = clrt.load(made), clrt.load(tmp_path / "a.glb")
    assert triangles(loaded) == triangles(expected) == 2 * 320 + 12
    for one, other in zip(loaded.meshes, expected.meshes, strict=True):
        np.testing.assert_array_equal(one.vertices, other.vertices)
        assert one.material == other.material
    assert any(mesh.material.color == pytest.approx((1, 0, 0)) for mesh in loaded.meshes)  # type: ignore[attr-defined]


@pytest.mark.programs
def test_rendering_is_that_of_its_file(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=3)
    (tmp_path / "a.glb").write_bytes(ball.export(file_type="glb"))
    one, other = (clrt.render(what, spp=1, size=(64, 64)).pixels for what in (ball, tmp_path / "a.glb"))
    np.testing.assert_array_equal(one, other)
    assert one.std() > 0.01


def test_rays_agree_with_trimesh() -> None:
    mesh = trimesh.creation.torus(1.0, 0.4)
    rng = np.random.default_rng(2)
    origins = rng.normal(size=(200, 3)) * 3
    directions = rng.normal(size=(200, 3)) - origins
    hits = clrt.RayQuery(mesh).closest_hit(origins, directions)
    expected = trimesh.ray.ray_triangle.RayMeshIntersector(mesh).intersects_first(origins, directions)
    np.testing.assert_array_equal(hits["primitive"], expected)
    assert (expected >= 0).sum() > 10


@pytest.mark.parametrize("empty", [trimesh.Scene(), trimesh.Trimesh(), trimesh.PointCloud(np.zeros((0, 3)))])
def test_what_has_no_triangles(empty: object) -> None:
    with pytest.raises(SceneError, match="trimesh"):
        clrt.load(empty)


def test_faces_may_be_missing_only_of_meshes() -> None:
    with pytest.raises(UsageError, match="faces is missing"):
        clrt.RayQuery(np.zeros((3, 3)))


def test_a_scene_is_made_of_meshes_and_scenes() -> None:
    """They are what the same files show, among clrt's own meshes."""
    own = clrt.Mesh(np.eye(3), [[0, 1, 2]])  # type: ignore[arg-type]
    made = clrt.Scene(meshes=[own, scene(), trimesh.creation.box()], spheres=[clrt.Sphere()])  # type: ignore[list-item]
    assert triangles(made) == 1 + 2 * 320 + 12 + 12 and made.meshes[0] is own
    for one, other in zip(made.meshes[1:], clrt.load(scene()).meshes):
        np.testing.assert_array_equal(one.vertices, other.vertices)
        assert one.material == other.material
    with pytest.raises(SceneError, match=r"meshes: <trimesh.* is not a list; write meshes=\[...\]"):
        clrt.Scene(meshes=trimesh.creation.box())
    with pytest.raises(SceneError, match=r"^meshes\[1\]: Trimesh of trimesh: its scene contains no triangles"):
        clrt.Scene(meshes=[trimesh.creation.box(), trimesh.Trimesh()])  # type: ignore[list-item]


def test_rays_hit_all_meshes_of_a_scene() -> None:
    made = scene()
    origins, down = np.array([[0, 0, 9], [3, 0, 9], [0, 0, 9], [8, 8, 9]], float), np.array([0, 0, -1.0])
    given: Any = made
    expected = clrt.RayQuery(made.to_mesh()).closest_hit(origins, down)
    assert np.array_equal(clrt.RayQuery(given).closest_hit(origins, down), expected)
    assert (expected["primitive"] >= 0).tolist() == [True, True, True, False]
