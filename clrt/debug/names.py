"""Names of a scene's objects, materials and lights, by their numbers in the kernels."""

from __future__ import annotations

from collections import Counter

import numpy as np
from numpy.typing import NDArray

from ..rendering.compile.compile_scene import CompiledScene
from ..rendering.compile.lights.light_types import TYPES
from ..rendering.compile.lights.pack_lights import lights_of
from ..scene.model import Instance, Mesh, Scene, Sphere
from ..scene.provenance import material_of

IntArray = NDArray[np.int64]


class SceneNames:
    """Names in one scene, as `compiled`. Objects are numbered as in the AOV `object`."""

    def __init__(self, scene: Scene, compiled: CompiledScene) -> None:
        self._scene, self._compiled = scene, compiled
        self._objects: list[Mesh | Instance | Sphere] = [*scene.meshes, *scene.instances, *scene.spheres]
        self._shared = Counter(_plain(each) for each in self._objects)
        self._materials = {id(material): name for name, material in scene.materials.items()}

    def hits(self, primitive: NDArray[np.int32], instance: NDArray[np.int32]) -> tuple[IntArray, IntArray]:
        """Return the objects that were hit, and which of their triangles, both (n,); −1 at misses."""
        return self._compiled.objects.at_hits(primitive, instance)

    def object(self, number: int) -> str:
        """Return an object's kind and name, and its number if others share those."""
        plain = _plain(self._objects[number])
        return plain if self._shared[plain] == 1 else f"{plain} (object {number})"

    def material(self, number: int) -> str:
        """Return the name of an object's material, if it has one, and its type."""
        each = self._objects[number]
        material = each.material if isinstance(each, Sphere) else material_of(each)
        mesh = each.mesh if isinstance(each, Instance) else each
        own = mesh.material_name if isinstance(mesh, Mesh) and mesh.material is material else ""
        name = self._materials.get(id(material)) or own
        return f'"{name}" ({material.kernel})' if name else material.kernel

    def light(self, number: int) -> str:
        """Return the name of an entry of the light table: an object, a light of the scene, or the environment."""
        first, kind = 0, ""
        for kind in TYPES:
            count = int(self._compiled.counts[f"{kind}_lights"][0])
            if number < first + count:
                break
            first += count
        index, buffers = number - first, self._compiled.buffers
        if kind == "triangle":
            return self.object(self._object_of(int(buffers["triangle_lights"][1]["primitive"][index])))
        if kind == "sphere":
            sphere = int(np.flatnonzero(buffers["spheres"][1]["light"] == number)[0])
            return self.object(self._object_of(int(self._compiled.counts["triangles"][0]) + sphere))
        if kind == "sky":
            return "the environment"
        light = lights_of(self._scene, kind)[index]
        entry = next(i for i, each in enumerate(self._scene.lights) if each is light)
        return f"light[{entry}] ({light.kernel})"

    def _object_of(self, primitive: int) -> int:
        """Return the object of a primitive that does not belong to an instance; primitives of instances come first."""
        placed = "placements" in self._compiled.buffers
        before = int(self._compiled.buffers["placements"][1]["first"][0]) if placed else 0
        return int(self.hits(np.array([primitive - before], np.int32), np.zeros(1, np.int32))[0][0])

    @property
    def infinite(self) -> str:
        """What escaping paths reach; empty if there is nothing."""
        found = {"SKY": "the environment", "LIGHT_SUN": "the discs of directional lights"}
        return " and ".join(name for feature, name in found.items() if feature in self._compiled.features)


def _plain(each: Mesh | Instance | Sphere) -> str:
    return f'{type(each).__name__.lower()} "{each.name}"'
