"""trimesh meshes with clrt's rays, compared with trimesh's own float64 engine and closed forms."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

import clrt.trimesh
from clrt.device.open import Device

RNG = np.random.default_rng(3)


def rays(n: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return RNG.uniform(-1.5, 1.5, (n, 3)), RNG.normal(size=(n, 3))


def reference(mesh: Any) -> Any:
    """Return trimesh's float64 engine."""
    return trimesh.ray.ray_triangle.RayMeshIntersector(mesh)


@pytest.mark.parametrize(
    "mesh",
    [
        trimesh.primitives.Sphere().to_mesh(),
        trimesh.creation.icosphere(),
        trimesh.creation.box(),
        trimesh.creation.cylinder(1, 2),
    ],
    ids=["sphere", "icosphere", "box", "cylinder"],
)
def test_a_corner_is_one_location(device: Device, mesh: Any) -> None:
    """trimesh's documented example: two rays, one of which enters and leaves at vertices of up to 32 triangles."""
    mesh.ray = clrt.trimesh.RayMeshIntersector(mesh, device=device.info.index)
    two = np.array([[0, 0, -5], [2, 2, -10]]), np.array([[0, 0, 1], [0, 0, 1]])
    locations, index_ray, index_tri = mesh.ray.intersects_location(*two)
    expected, _, _ = reference(mesh).intersects_location(*two)
    np.testing.assert_allclose(locations, expected[np.argsort(expected[:, 2])], atol=1e-15, rtol=0)
    assert index_ray.tolist() == [0, 0] and len(mesh.ray.intersects_id(*two)[0]) >= 2
    assert len(mesh.ray.intersects_id(*two, return_locations=True)[0]) == 2


def test_same_answers_as_trimesh(device: Device) -> None:
    """A torus inside a box, away from edges, where rounding decides whether trimesh's engine hits."""
    mesh = trimesh.util.concatenate([trimesh.creation.torus(0.7, 0.25), trimesh.creation.box((2.5, 2.5, 2.5))])
    own = clrt.trimesh.RayMeshIntersector(mesh, device=device.info.index)
    theirs = reference(mesh)
    origins, directions = rays(400)
    ours, expected = own.intersects_location(origins, directions), theirs.intersects_location(origins, directions)
    assert [a.dtype for a in ours] == [a.dtype for a in expected] and ours[0].shape == expected[0].shape
    order, expected_order = (np.lexsort((triangle, ray)) for _, ray, triangle in (ours, expected))
    for a, b, exact in zip(ours, expected, (False, True, True)):
        np.testing.assert_allclose(a[order], b[expected_order], atol=0 if exact else 1e-14, rtol=0)
    for method in ("intersects_first", "intersects_any"):
        ours, expected = (getattr(engine, method)(origins, directions) for engine in (own, theirs))
        np.testing.assert_array_equal(ours, expected)
    triangle, ray = own.intersects_id(origins, directions, multiple_hits=False)
    np.testing.assert_array_equal(triangle, own.intersects_first(origins, directions)[ray])


def test_locations_lie_on_ray_and_plane(device: Device) -> None:
    """Locations are accurate to float64, although hits are found in float32."""
    mesh = trimesh.creation.icosphere(subdivisions=4)
    origins, directions = rays(5000)
    locations, index_ray, index_tri = clrt.trimesh.RayMeshIntersector(
        mesh, device=device.info.index
    ).intersects_location(origins, directions)
    unit = directions[index_ray] / np.linalg.norm(directions[index_ray], axis=1, keepdims=True)
    assert len(locations) > 1000
    assert np.abs(np.cross(locations - origins[index_ray], unit)).max() < 2e-15
    plane = (locations - mesh.triangles[index_tri][:, 0]) * mesh.face_normals[index_tri]
    assert np.abs(plane.sum(axis=1)).max() < 4e-15


def test_rays_along_a_plane_are_located_on_the_triangle(device: Device) -> None:
    """In float64 such rays intersect the plane anywhere or nowhere; most float32 hits lie inside the triangle."""
    mesh = trimesh.creation.icosphere()
    corners = mesh.triangles[RNG.integers(0, len(mesh.faces), 5000)]
    one, other = (np.einsum("nk,nkj->nj", weights, corners) for weights in RNG.dirichlet([1, 1, 1], (2, 5000)))
    locations, _, index_tri = clrt.trimesh.RayMeshIntersector(mesh, device=device.info.index).intersects_location(
        one - 9 * (other - one), other - one
    )
    assert len(locations) > 1000
    hit = mesh.triangles[index_tri]
    beyond = np.maximum(hit.min(axis=1) - locations, locations - hit.max(axis=1)).max(axis=1)
    assert (beyond > 1e-5).mean() < 1e-3 and beyond.max() < 0.2


def test_contains_points(device: Device) -> None:
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=1.0)
    points = RNG.uniform(-1.2, 1.2, (5000, 3))
    radius = np.linalg.norm(points, axis=1)
    contains = clrt.trimesh.RayMeshIntersector(mesh, device=device.info.index).contains_points(points)
    np.testing.assert_array_equal(contains[radius > 1], False)
    np.testing.assert_array_equal(contains[radius < 0.99], True)


def test_a_hundred_shells_hide_none(device: Device) -> None:
    """The center lies inside all 121 spheres, an odd number; a ray through them hits each twice."""
    shells = [trimesh.creation.icosphere(subdivisions=1, radius=radius) for radius in np.linspace(0.1, 1, 121)]
    ray = clrt.trimesh.RayMeshIntersector(trimesh.util.concatenate(shells), device=device.info.index)
    between = 0.5 * (shells[7].vertices[:1] + shells[8].vertices[:1])
    np.testing.assert_array_equal(ray.contains_points([[0, 0, 0.01], *between, [0, 0, 1.01]]), [True, True, False])
    through = [[0.01, 0.02, -5]], [[0, 0, 1]]
    assert len(ray.intersects_location(*through)[0]) == len(ray.intersects_id(*through)[0]) == 242
    assert len(ray.intersects_location(*through, max_hits=3)[0]) == 3
    assert len(ray.intersects_location(*through, multiple_hits=False)[0]) == 1


def test_a_changed_mesh_is_asked_anew(device: Device) -> None:
    mesh = trimesh.creation.box()
    mesh.ray = clrt.trimesh.RayMeshIntersector(mesh, device=device.info.index)
    places = [[0, 0, 0], [100, 0, 0]]
    assert mesh.contains(places).tolist() == [True, False]
    mesh.apply_translation([100, 0, 0])
    assert mesh.contains(places).tolist() == [False, True]
    mesh.update_faces(mesh.face_normals[:, 2] < 0.5)
    down = [100.1, 0.2, 9], [0, 0, -1]
    np.testing.assert_allclose(mesh.ray.intersects_location(*down)[0], [[100.1, 0.2, -0.5]], atol=1e-13)
    mesh.vertices[:, 2] += 1
    np.testing.assert_allclose(mesh.ray.intersects_location(*down)[0], [[100.1, 0.2, 0.5]], atol=1e-13)


def test_a_pickled_mesh_answers(device: Device) -> None:
    mesh = trimesh.creation.box()
    mesh.ray = clrt.trimesh.RayMeshIntersector(mesh, device=device.info.index)
    copy = pickle.loads(pickle.dumps(mesh))
    copy.apply_translation([9, 0, 0])
    assert copy.contains([[9, 0, 0]]).all() and mesh.contains([[0, 0, 0]]).all()


@pytest.mark.parametrize("shape", [(3, 300), (300, 2), (300,), (2, 2, 3)])
@pytest.mark.parametrize(
    "method", ["intersects_id", "intersects_location", "intersects_first", "intersects_any", "contains_points"]
)
def test_arrays_of_other_shapes_are_refused(device: Device, method: str, shape: tuple[int, ...]) -> None:
    ray = clrt.trimesh.RayMeshIntersector(trimesh.creation.box(), device=device.info.index)
    with pytest.raises(clrt.UsageError, match="must have"):
        getattr(ray, method)(*[np.ones(shape)] * (1 if method == "contains_points" else 2))


@pytest.mark.parametrize("other", [None, trimesh.Scene(trimesh.creation.box()), trimesh.PointCloud([[0, 0, 0]])])
def test_what_is_no_mesh_is_refused(other: Any) -> None:
    with pytest.raises(clrt.UsageError, match=rf"{type(other).__name__}.*to_mesh"):
        clrt.trimesh.RayMeshIntersector(other)


def test_coincident_surfaces_are_one_place(device: Device) -> None:
    """64 coincident triangles count once, as in trimesh's engines; one at a distance of float32 epsilon is separate."""
    corners = np.array([[-1, -1, 0], [3, -1, 0], [-1, 3, 0]], np.float32)
    further = corners + np.array([0, 0, np.finfo(np.float32).eps], np.float32)
    mesh = trimesh.Trimesh(np.concatenate([corners, further]), [[0, 1, 2]] * 64 + [[3, 4, 5]], process=False)
    ray = clrt.trimesh.RayMeshIntersector(mesh, device=device.info.index)
    for most, expected in ((None, [0, 64]), (2, [0, 64]), (1, [0])):
        triangle, index_ray = ray.intersects_id([[0, 0, -1]], [[0, 0, 1]], max_hits=most)
        assert triangle.tolist() == expected and not index_ray.any()


def test_a_doubled_surface_contains_what_it_did(device: Device) -> None:
    """With each face of a sphere doubled, a ray crosses one surface, as in trimesh's engines."""
    ball = trimesh.creation.icosphere()
    double = trimesh.Trimesh(ball.vertices, np.concatenate([ball.faces, ball.faces]), process=False)
    points = RNG.uniform(-1.2, 1.2, (500, 3))
    expected = clrt.trimesh.RayMeshIntersector(ball, device=device.info.index).contains_points(points)
    np.testing.assert_array_equal(
        clrt.trimesh.RayMeshIntersector(double, device=device.info.index).contains_points(points), expected
    )


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e7])
def test_edges_and_corners_are_one_place(device: Device, scale: float) -> None:
    """A ray through a convex mesh enters once and leaves once, also at its edges and corners."""
    for mesh in (trimesh.creation.box(), trimesh.creation.icosphere(subdivisions=2), trimesh.creation.cylinder(1, 2)):
        mesh.apply_transform(trimesh.transformations.random_rotation_matrix(RNG.random(3)))
        mesh.apply_scale(scale)
        mesh.apply_translation(scale * RNG.normal(size=3))
        ends, along = mesh.vertices[mesh.edges_unique], RNG.random((len(mesh.edges_unique), 1))
        met = np.concatenate([mesh.vertices, ends[:, 0] + along * (ends[:, 1] - ends[:, 0]), ends.mean(axis=1)])
        # Through the center: half of the other directions would not enter the mesh.
        directions = mesh.center_mass - met
        origins = met - directions * RNG.uniform(0.5, 20, (len(met), 1))
        ray = clrt.trimesh.RayMeshIntersector(mesh, device=device.info.index)
        locations, index_ray, index_tri = ray.intersects_location(origins, directions)
        np.testing.assert_array_equal(np.bincount(index_ray, minlength=len(met)), 2)
        np.testing.assert_allclose(locations[::2], met, atol=2e-6 * mesh.scale, rtol=0)
        assert [each.tolist() for each in ray.intersects_id(origins, directions)] == [
            index_tri.tolist(),
            index_ray.tolist(),
        ]


@pytest.mark.parametrize("middle", [0.0, 3e5])
def test_a_surface_that_a_ray_leaves_counts(device: Device, middle: float) -> None:
    """A ray that starts on a surface hits it, as in trimesh's float64 engine; 1e-4 farther out it does not."""
    mesh = trimesh.creation.icosphere()
    mesh.apply_translation((middle, -middle, middle))
    points, face = trimesh.sample.sample_surface(mesh, 500, seed=1)
    outward, ray = mesh.face_normals[face], clrt.trimesh.RayMeshIntersector(mesh, device=device.info.index)
    for method in ("intersects_first", "intersects_any"):
        for step in (0.0, 1e-4):
            ours, theirs = (getattr(each, method)(points + step * outward, outward) for each in (ray, reference(mesh)))
            np.testing.assert_array_equal(ours, theirs)
    inward, _ = ray.intersects_id(points, -outward)
    np.testing.assert_array_equal(inward[::2], face)
    assert len(inward) == 2 * len(face)


def test_what_is_made_when_asked_for(device: Device) -> None:
    """A primitive's faces and an intersector's BVH are created on first use."""
    box: Any = trimesh.primitives.Box(extents=(2, 2, 2))
    box.ray = clrt.trimesh.RayMeshIntersector(box, False, device=device.info.index)
    box.primitive.extents = (4, 4, 4)
    np.testing.assert_allclose(box.ray.intersects_location([[0.1, 0.2, -9]], [[0, 0, 1]])[0][:, 2], [-2, 2])


def test_arguments_by_place_are_trimeshs(device: Device) -> None:
    """The order multiple_hits, max_hits, return_locations is that of trimesh's default engine."""
    mesh = trimesh.creation.box()
    ray, through = clrt.trimesh.RayMeshIntersector(mesh, device=device.info.index), ([[0.1, 0.2, -9]], [[0, 0, 1]])
    ours, theirs = (each.intersects_id(*through, True, 1, True) for each in (ray, mesh.ray))
    assert [each.tolist() for each in ours] == [each.tolist() for each in theirs]


def test_a_mesh_without_faces_is_met_by_nothing(device: Device) -> None:
    ray = clrt.trimesh.RayMeshIntersector(trimesh.Trimesh(), device=device.info.index)
    assert not ray.intersects_any([[0, 0, 0]], [[0, 0, 1]]).any()
    assert [len(each) for each in ray.intersects_location([[0, 0, 0]], [[0, 0, 1]])] == [0, 0, 0]


@pytest.mark.filterwarnings("error")
def test_numpy_that_raises_is_no_matter(device: Device) -> None:
    ray = clrt.trimesh.RayMeshIntersector(trimesh.creation.icosphere(), device=device.info.index)
    with np.errstate(all="raise"):
        for directions in ([[0, 0, 1]], [[0, 0, 0]], [[1e-300, 0, 1e-200]], [[0, np.nan, np.inf]]):
            for origin in ([[0, 0, 0]], [[1e-300, 0, -3]], [[1e30, 0, 0]], [[np.inf, 0, 0]]):
                assert len(ray.intersects_location(origin, directions)[1]) <= 2
                assert ray.intersects_any(origin, directions).shape == ray.intersects_first(origin, directions).shape
