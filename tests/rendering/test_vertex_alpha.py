"""Vertex colors with alpha: which materials are compiled as not opaque, and what stays shared."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from clrt.rendering.compile.materials.vertex_alpha import BELOW_ONE, with_vertex_alpha
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import Instance, Mesh, Scene

CORNERS, FACES = np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32)
CLEAR, SOLID = np.full((3, 4), 0.5, np.float32), np.ones((3, 4), np.float32)


def test_scenes_without_alpha_stay_as_they_are() -> None:
    """No alpha, none below 1, or no vertex colors at all."""
    meshes = [Mesh(CORNERS, FACES, Diffuse(), colors=colors) for colors in (None, CLEAR[:, :3], SOLID)]
    scene = Scene(meshes=meshes, instances=[Instance(meshes[2], material=Diffuse())])
    assert with_vertex_alpha(scene) is scene


def test_opacity_of_meshes_and_instances() -> None:
    """A mesh's own material and one that replaces it, each only where the colors have alpha; other opacities and
    materials of other meshes stay, and what was one object is one object."""
    paint, veil, cut = Diffuse(), Diffuse(opacity=0.5), Diffuse(alpha_cutoff=0.5)
    clear, solid = Mesh(CORNERS, FACES, paint, colors=CLEAR), Mesh(CORNERS, FACES, paint, colors=SOLID)
    scene = Scene(
        meshes=[clear, solid, replace(clear, material=veil), replace(clear, material=cut)],
        instances=[Instance(clear), Instance(clear, material=veil), Instance(clear, material=paint), Instance(solid)],
    )
    found = with_vertex_alpha(scene)
    first, second, third, fourth = found.meshes
    assert first.material.opacity == BELOW_ONE and second is solid
    assert third.material is veil and fourth.material.opacity == BELOW_ONE
    assert fourth.material.alpha_cutoff == 0.5 * BELOW_ONE
    assert [each.mesh is first for each in found.instances] == [True, True, True, False]
    assert [each.material for each in found.instances] == [None, veil, first.material, None]
    assert found.instances[2].material is first.material and found.instances[3] is scene.instances[3]
    assert all(mesh.material.opacity in (1, 0.5) for mesh in scene.meshes)
