"""Modified copies of scenes. Scenes are never changed in place; unchanged parts are shared."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import replace

from .geometry.instancing import meshes_by_id
from .materials.material_types import Material
from .model import Instance, Mesh, Scene, Sphere


def materials_of(scene: Scene) -> dict[str, Material]:
    """Return all materials by name, each once: the scene file's named ones first, then those named by a model file,
    then the rest by the name of their object. Equal materials count as different if they are different objects."""
    named = dict(scene.materials)
    known = {id(material) for material in named.values()}
    meshes = [*scene.meshes, *meshes_by_id(scene.instances).values()]
    users: list[tuple[str, Material | None]] = [(mesh.material_name or mesh.name, mesh.material) for mesh in meshes]
    users += [(instance.name, instance.material) for instance in scene.instances]
    users += [(sphere.name, sphere.material) for sphere in scene.spheres]
    numbers: dict[str, int] = {}
    for name, material in users:
        if material is not None and id(material) not in known:
            known.add(id(material))
            named[free_name(name, named, numbers)] = material
    return named


def with_material(scene: Scene, old: Material, new: Material) -> Scene:
    """Return the scene with `new` in place of this very object `old`, also among the scene's named materials."""
    meshes = {
        id(mesh): replace(mesh, material=new) if mesh.material is old else mesh
        for mesh in (*scene.meshes, *meshes_by_id(scene.instances).values())
    }

    def changed(instance: Instance) -> Instance:
        mesh: Mesh = meshes[id(instance.mesh)]
        material = new if instance.material is old else instance.material
        same = mesh is instance.mesh and material is instance.material
        return instance if same else replace(instance, mesh=mesh, material=material)

    spheres: list[Sphere] = [replace(each, material=new) if each.material is old else each for each in scene.spheres]
    named = {name: new if material is old else material for name, material in scene.materials.items()}
    return replace(
        scene,
        meshes=[meshes[id(mesh)] for mesh in scene.meshes],
        spheres=spheres,
        materials=named,
        instances=[changed(instance) for instance in scene.instances],
    )


def free_name(name: str, taken: Container[str], numbers: dict[str, int] | None = None) -> str:
    """Return the name, or the name followed by the first number from 2 that makes it not `taken`. numbers: the last
    number tried per name; pass the same dict to many calls to save time."""
    number, free = 1, name
    while free in taken:
        number = max(number + 1, 2 if numbers is None else numbers.get(name, 2))
        free = f"{name} {number}"
    if numbers is not None:
        numbers[name] = number
    return free
