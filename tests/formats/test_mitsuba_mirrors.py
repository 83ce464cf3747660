"""Front sides of mirrored Mitsuba shapes: emission is on the side on which Mitsuba 3.9 emits."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from .test_mitsuba_xml import scene


@pytest.mark.parametrize(
    ("normals", "flat", "facing"), [(False, False, -1), (False, True, -1), (True, False, 1), (True, True, -1)]
)
def test_a_mirror_turns_files_inside_out_but_for_their_own_normals(
    tmp_path: Path, normals: bool, flat: bool, facing: int
) -> None:
    """A triangle that faces +z, mirrored in x: Mitsuba 3.9 computes winding in world space, so it emits towards −z."""
    own = "vn 0 0 1\n" if normals else ""
    corner = "//1" if normals else ""
    (tmp_path / "one.obj").write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\n{own}f 1{corner} 2{corner} 3{corner}\n")
    mesh = scene(
        tmp_path,
        f"""<shape type="obj"><string name="filename" value="one.obj"/>
        <boolean name="face_normals" value="{str(flat).lower()}"/>
        <transform name="to_world"><scale x="-1"/></transform></shape>""",
    ).meshes[0]
    a, b, c = mesh.vertices[mesh.faces[0]]
    assert np.allclose(np.cross(b - a, c - a), [0, 0, facing])
    assert (mesh.normals is None) == flat
    assert mesh.normals is None or np.allclose(mesh.normals, [0, 0, facing])


def test_a_mirror_turns_spheres_inside_out(tmp_path: Path) -> None:
    """Emitters emit inwards, as in Mitsuba 3.9; a sphere without emission or glass stays a sphere."""
    mirrored = '<shape type="sphere"><transform name="to_world"><scale y="-2" x="2" z="2"/></transform>{}</shape>'
    assert not scene(tmp_path, mirrored.format("")).meshes
    for inside in ('<emitter type="area"/>', '<bsdf type="dielectric"/>'):
        (mesh,) = scene(tmp_path, mirrored.format(inside)).meshes
        triangles = mesh.vertices[mesh.faces].astype(np.float64)
        outwards = np.einsum(
            "ij,ij->i",
            np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]),
            triangles.mean(axis=1),
        )
        assert outwards.max() <= 1e-9 > outwards.min()
        assert mesh.normals is not None and np.allclose(mesh.normals, -mesh.vertices / 2, atol=1e-6)


@pytest.mark.parametrize("kind", ["rectangle", "disk", "cube", "cylinder"])
def test_a_mirror_leaves_other_shapes(tmp_path: Path, kind: str) -> None:
    """They emit from the side of their own normals, which in Mitsuba 3.9 a mirror leaves outside."""
    plain, mirrored = (
        scene(
            tmp_path,
            f'<shape type="{kind}"><transform name="to_world"><scale x="{x}"/></transform>'
            '<emitter type="area"/></shape>',
        ).meshes[0]
        for x in (1, -1)
    )
    assert plain.normals is not None and mirrored.normals is not None
    np.testing.assert_allclose(mirrored.normals, plain.normals * (-1, 1, 1), atol=1e-6)
    for mesh in (plain, mirrored):
        corners = mesh.vertices[mesh.faces].astype(np.float64)
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        solid = np.linalg.norm(cross, axis=1) > 1e-9
        assert mesh.normals is not None
        assert (np.einsum("ij,ij->i", cross, mesh.normals[mesh.faces].sum(1))[solid] > 0).all()


def test_mirrored_instances_keep_their_spheres(tmp_path: Path) -> None:
    """An instance transforms normals, so glass stays glass."""
    read = scene(
        tmp_path,
        """
        <shape type="shapegroup" id="group"><shape type="sphere"><bsdf type="dielectric"/></shape></shape>
        <shape type="instance"><ref id="group"/><transform name="to_world"><scale x="-1"/></transform></shape>""",
    )
    assert len(read.spheres) == 1 and not read.meshes
