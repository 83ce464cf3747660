"""Opacity by the alpha of vertex colors, which multiplies that of the material."""

from __future__ import annotations

from dataclasses import replace

from ....scene.geometry.instancing import meshes_by_id
from ....scene.materials.material_types import Material
from ....scene.model import Scene

#: An opacity that is compiled as one below 1.
BELOW_ONE = 1 - 2.0**-24


def with_vertex_alpha(scene: Scene) -> Scene:
    """Return the same scene without opaque materials on meshes whose vertex colors have alpha.

    They would be compiled as opaque. Meshes and materials that are shared stay so.
    """
    meshes = meshes_by_id(scene.instances) | {id(mesh): mesh for mesh in scene.meshes}
    clear = {number for number, mesh in meshes.items() if mesh.has_alpha}
    if not clear:
        return scene
    materials = dict[int, Material]()

    def translucent(material: Material) -> Material:
        if material.opacity != 1:
            return material
        cutoff = None if material.alpha_cutoff is None else material.alpha_cutoff * BELOW_ONE
        return materials.setdefault(id(material), replace(material, opacity=BELOW_ONE, alpha_cutoff=cutoff))

    for number in clear:
        meshes[number] = replace(meshes[number], material=translucent(meshes[number].material))
    instances = [
        replace(each, mesh=meshes[id(each.mesh)], material=each.material and translucent(each.material))
        if id(each.mesh) in clear
        else each
        for each in scene.instances
    ]
    return replace(scene, meshes=[meshes[id(mesh)] for mesh in scene.meshes], instances=instances)
