"""Numbers of a scene's objects and materials, as in the AOVs `object` and `material`, with their names."""

from __future__ import annotations

from .materials.material_types import Material
from .model import Instance, Mesh, Scene, Sphere
from .on_ground import GroundMesh


def objects_of(scene: Scene) -> list[Mesh | Instance | Sphere]:
    """Return the objects by number: meshes, then instances, then spheres, and last the ground's mesh."""
    return sorted(_every(scene), key=_is_ground)


def numbers_of(scene: Scene) -> list[int]:
    """Return the numbers of the scene's meshes, its instances and its spheres."""
    every = _every(scene)
    order = sorted(range(len(every)), key=lambda i: _is_ground(every[i]))
    return sorted(order, key=order.__getitem__)


def _every(scene: Scene) -> list[Mesh | Instance | Sphere]:
    return [*scene.meshes, *scene.instances, *scene.spheres]


def _is_ground(thing: Mesh | Instance | Sphere) -> bool:
    return isinstance(thing, GroundMesh)


def materials_of(scene: Scene) -> tuple[list[Material], list[int]]:
    """Return the distinct materials by number, in the order in which objects use them, and that of each object."""
    distinct: dict[Material, int] = {}
    used = [
        (each.material or each.mesh.material) if isinstance(each, Instance) else each.material
        for each in objects_of(scene)
    ]
    numbers = [distinct.setdefault(material, len(distinct)) for material in used]
    return list(distinct), numbers


def object_names(scene: Scene) -> list[str]:
    """Return the objects' names by number."""
    return [each.name for each in objects_of(scene)]


def material_names(scene: Scene) -> list[str]:
    """Return the materials' names by number: in the scene file, else in the model file, else of an object with it."""
    distinct, numbers = materials_of(scene)
    named = {material: name for name, material in scene.materials.items()}
    names = [""] * len(distinct)
    for each, number in zip(objects_of(scene), numbers):
        own = each.material_name if isinstance(each, Mesh) else ""
        names[number] = names[number] or named.get(distinct[number], "") or own or each.name
    return names
