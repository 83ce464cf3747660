"""Which instances are worth it: those that save memory. All others become meshes, since rays pass one tree faster."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .materials import Material
from .model import Instance, Mesh, Scene
from .transform import transform_mesh

Stored = tuple[int, int | None]
#: Up to so many triangles that would otherwise not be stored, all instances become meshes.
FEW_TRIANGLES = 1 << 16


class Arranged(NamedTuple):
    """A scene, and which objects of the one it was made from its meshes and its instances are.

    Objects are numbered: first the meshes, then the instances, then the spheres.
    """

    scene: Scene
    meshes: list[int]
    instances: list[int]


def arranged(scene: Scene) -> Arranged:
    """The same scene with instances only where they save memory; what else they show is among its meshes.

    A mesh that is drawn itself, too, becomes one more instance of it. Lamps become meshes, so that lights need not know
    of instances.
    """
    shown = meshes_by_id(scene.instances)
    itself = [i for i, mesh in enumerate(scene.meshes) if id(mesh) in shown]
    others = [i for i, mesh in enumerate(scene.meshes) if id(mesh) not in shown]
    every = [Instance(scene.meshes[i], name=scene.meshes[i].name) for i in itself] + scene.instances
    objects = itself + list(range(len(scene.meshes), len(scene.meshes) + len(scene.instances)))
    keeps = worth_it(every)
    kept = [i for i, keep in enumerate(keeps) if keep]
    rest = [i for i, keep in enumerate(keeps) if not keep]
    meshes = [scene.meshes[i] for i in others] + [baked(every[i]) for i in rest]
    return Arranged(replace(scene, instances=[every[i] for i in kept], meshes=meshes),
                    others + [objects[i] for i in rest], [objects[i] for i in kept])


def worth_it(instances: list[Instance]) -> list[bool]:
    """Which of the instances save memory; the others had better be meshes."""
    glows = [any(_material(each).radiance) for each in instances]
    copies = Counter(_stored(each) for each, glow in zip(instances, glows) if not glow)
    sizes = {_stored(each): len(each.mesh.faces) for each in instances}
    saved = sum((count - 1) * sizes[stored] for stored, count in copies.items())
    return [saved > FEW_TRIANGLES and not glow and copies[_stored(each)] > 1 for each, glow in zip(instances, glows)]


def baked(instance: Instance) -> Mesh:
    """The mesh that an instance shows, in the world."""
    mesh = replace(painted(instance), name=instance.name)
    return transform_mesh(mesh, np.vstack([instance.to_world, [0.0, 0.0, 0.0, 1.0]]))


def painted(instance: Instance) -> Mesh:
    """The mesh that an instance shows, in its own frame, in the instance's material."""
    return replace(instance.mesh, material=_material(instance))


def meshes_by_id(instances: Iterable[Instance]) -> dict[int, Mesh]:
    """The meshes that instances show, each once."""
    return {id(each.mesh): each.mesh for each in instances}


def unfolded(scene: Scene) -> Scene:
    """The same scene with a mesh for each instance."""
    return replace(scene, instances=[], meshes=scene.meshes + [baked(each) for each in scene.instances])


def prototypes(instances: list[Instance]) -> tuple[list[Mesh], NDArray[np.int32]]:
    """What instances show, each mesh once and in the material of its first one; and which of them each shows, (k,)."""
    first: dict[Stored, tuple[int, Instance]] = {}
    which = [first.setdefault(_stored(each), (len(first), each))[0] for each in instances]
    return [painted(each) for _, each in first.values()], np.array(which, np.int32)


def _stored(instance: Instance) -> Stored:
    """What instances must share to be stored once: the mesh, and tangents for a normal map."""
    bumps = _material(instance).bent_by
    return id(instance.mesh), None if bumps is None else bumps.uv_set


def _material(instance: Instance) -> Material:
    return instance.material or instance.mesh.material
