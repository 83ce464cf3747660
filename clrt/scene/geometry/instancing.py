"""Choice of the instances that save memory; the others become meshes, since a single BVH is traversed faster."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..materials.material_types import Material
from ..model import Instance, Mesh, Scene
from .transform import transform_mesh

Stored = tuple[int, int | None]
#: If instancing saves at most this many triangles, all instances become meshes.
FEW_TRIANGLES = 1 << 16


class ArrangedScene(NamedTuple):
    """A scene, and for each of its meshes and instances the number of its object in the original scene.

    Objects are numbered: first the meshes, then the instances, then the spheres.
    """

    scene: Scene
    meshes: list[int]
    instances: list[int]


def arranged(scene: Scene) -> ArrangedScene:
    """Return the same scene with instances only if they save memory; the others become meshes.

    A mesh that the scene also contains directly becomes one more instance. Instances that move stay, and emissive
    ones of these get a mesh of their own, whose triangles are their lights. Other emissive instances become meshes, so
    that light sampling need not handle instances.
    """
    shown = meshes_by_id(scene.instances)
    itself = [i for i, mesh in enumerate(scene.meshes) if id(mesh) in shown]
    others = [i for i, mesh in enumerate(scene.meshes) if id(mesh) not in shown]
    every = [Instance(scene.meshes[i], name=scene.meshes[i].name) for i in itself] + scene.instances
    objects = itself + list(range(len(scene.meshes), len(scene.meshes) + len(scene.instances)))
    keeps = [saves or each.to_world_end is not None for saves, each in zip(worth_it(every), every)]
    kept = [i for i, keep in enumerate(keeps) if keep]
    rest = [i for i, keep in enumerate(keeps) if not keep]
    meshes = [scene.meshes[i] for i in others] + [baked(every[i]) for i in rest]
    return ArrangedScene(
        replace(scene, instances=[_alone_if_emissive(every[i]) for i in kept], meshes=meshes),
        others + [objects[i] for i in rest],
        [objects[i] for i in kept],
    )


def worth_it(instances: list[Instance]) -> list[bool]:
    """Return which instances save memory; the others should become meshes, unless they move."""
    glows = [any(_material(each).radiance) for each in instances]
    copies = Counter(_stored(each) for each, glow in zip(instances, glows) if not glow)
    sizes = {_stored(each): len(each.mesh.faces) for each in instances}
    saved = sum((count - 1) * sizes[stored] for stored, count in copies.items())
    return [saved > FEW_TRIANGLES and not glow and copies[_stored(each)] > 1 for each, glow in zip(instances, glows)]


def _alone_if_emissive(instance: Instance) -> Instance:
    """Return the instance, of a mesh of its own if it emits light."""
    return replace(instance, mesh=painted(instance)) if any(_material(instance).radiance) else instance


def baked(instance: Instance) -> Mesh:
    """Return an instance's mesh in world coordinates."""
    mesh = replace(painted(instance), name=instance.name)
    return transform_mesh(mesh, np.vstack([instance.to_world, [0.0, 0.0, 0.0, 1.0]]))


def painted(instance: Instance) -> Mesh:
    """Return an instance's mesh in its own frame, with the instance's material."""
    return replace(instance.mesh, material=_material(instance))


def meshes_by_id(instances: Iterable[Instance]) -> dict[int, Mesh]:
    """Return the distinct meshes of instances by `id`."""
    return {id(each.mesh): each.mesh for each in instances}


def unfolded(scene: Scene) -> Scene:
    """Return the same scene with a mesh for each instance."""
    return replace(scene, instances=[], meshes=scene.meshes + [baked(each) for each in scene.instances])


def prototypes(instances: list[Instance]) -> tuple[list[Mesh], NDArray[np.int32]]:
    """Return the distinct meshes of instances, with the material of the first use, and each instance's index (k,)."""
    first: dict[Stored, tuple[int, Instance]] = {}
    which = [first.setdefault(_stored(each), (len(first), each))[0] for each in instances]
    return [painted(each) for _, each in first.values()], np.array(which, np.int32)


def _stored(instance: Instance) -> Stored:
    """Return the key of instances that can share storage: the mesh, and the uv set of its normal map's tangents."""
    bumps = _material(instance).bent_by
    return id(instance.mesh), None if bumps is None else bumps.uv_set


def _material(instance: Instance) -> Material:
    return instance.material or instance.mesh.material
