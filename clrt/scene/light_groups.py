"""Light groups of a scene: its emitters by name, whose light a render can store in separate layers."""

from __future__ import annotations

from collections.abc import Iterator

from ..errors import SceneError
from .materials.material import Material
from .model import Scene

#: The group of all emitters without a name of a group, and of what is behind the scene and on catchers.
DEFAULT = "default"
#: Maximum number of groups: each takes 24 bytes per pixel of a film, and registers of a kernel.
MOST_GROUPS = 16


def group_of(name: str) -> str:
    """Return the group of an emitter with this name of a group."""
    return name or DEFAULT


def light_groups(scene: Scene) -> tuple[str, ...]:
    """Return the names of the groups that light the image, sorted, DEFAULT last. Raises SceneError for too many."""
    names = set(map(group_of, _names(scene)))
    if len(names) > MOST_GROUPS:
        raise SceneError(
            f"the scene has {len(names)} light groups ({', '.join(sorted(names))}), and a film stores at most "
            f"{MOST_GROUPS}; give some lights the same light_group"
        )
    return tuple(sorted(names, key=lambda name: (name == DEFAULT, name))) or (DEFAULT,)


def _names(scene: Scene) -> Iterator[str]:
    """Yield the names of the groups of all emitters, also of dark ones, and "" for what else is in the image."""
    sky = scene.environment
    if sky.light_group or sky.image is not None or any(sky.color):
        yield sky.light_group
    yield from (light.light_group for light in scene.lights)
    materials = list(_materials(scene))
    yield from (material.light_group for material in materials if material.light_group or any(material.radiance))
    if scene.backdrop is not None or any(material.catcher for material in materials):
        yield ""


def _materials(scene: Scene) -> Iterator[Material]:
    yield from (mesh.material for mesh in scene.meshes)
    yield from (sphere.material for sphere in scene.spheres)
    yield from (instance.material or instance.mesh.material for instance in scene.instances)
