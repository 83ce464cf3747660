"""Packing of the light groups of emitters (kernels/light/groups.cl), for films that store each group's light."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import compress

import numpy as np

from ....device.programs.preamble import Buffers
from ....scene.light_groups import group_of
from ....scene.model import Scene
from ..records import EMITTER_GROUP
from .light_types import LIGHT_KERNELS
from .pack_lights import PackedLights, lights_of


def pack_emitter_groups(scene: Scene, emitters: PackedLights, groups: Sequence[str]) -> Buffers:
    """Return the number, in `groups`, of each light's group, in the order of the lights' numbers, and last that of the
    environment's, sampled or not."""
    names = _surface_names(scene, emitters)
    names += [light.light_group for kernel in LIGHT_KERNELS for light in lights_of(scene, kernel)]
    names += [scene.environment.light_group] * (emitters.counts.get("sky", 0) + 1)
    numbers = {group_of(scene.environment.light_group): 0}  # of a black one, whose group need not be among them
    numbers |= {name: number for number, name in enumerate(groups)}
    return {"emitter_groups": ("EmitterGroup", np.array([numbers[group_of(name)] for name in names], EMITTER_GROUP))}


def _surface_names(scene: Scene, emitters: PackedLights) -> list[str]:
    """Return the names of the groups of emissive triangles and spheres, light by light."""
    of_triangle = np.repeat(np.arange(len(scene.meshes)), [len(mesh.faces) for mesh in scene.meshes])
    meshes = _first_of_each(emitters.triangle, of_triangle.tolist())
    spheres = _first_of_each(emitters.sphere, range(len(scene.spheres)))
    return [
        *(scene.meshes[number].material.light_group for number in meshes),
        *(scene.spheres[number].material.light_group for number in spheres),
    ]


def _first_of_each(light: np.ndarray[tuple[int, ...], np.dtype[np.int32]], owners: Sequence[int]) -> list[int]:
    """Return the owner of each light, given the light of each primitive, −1 for none, and the primitives' owners."""
    _, first = np.unique(light[light >= 0], return_index=True)
    lit = list(compress(owners, light >= 0))
    return [lit[index] for index in first]
