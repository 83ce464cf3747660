"""Meshes that a file places, once or several times, as meshes and instances of a scene."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..scene.geometry.instancing import baked, worth_it
from ..scene.geometry.transform import Matrix, transform_faults
from ..scene.model import Instance, Mesh


def shown(places: Iterable[tuple[Mesh, Matrix]]) -> tuple[list[Mesh], list[Instance]]:
    """Split placed meshes into meshes in world coordinates, and instances where these save memory.

    A singular matrix is accepted, as exporters use it to hide objects; its mesh is not instanced.
    """
    every = [Instance(mesh, matrix[:3], name=mesh.name) for mesh, matrix in places]
    to_world = np.array([each.to_world for each in every]).reshape(-1, 3, 4)
    flat = np.any([*transform_faults(to_world).values()], axis=0)
    sound = [each for each, is_flat in zip(every, flat) if not is_flat]
    kept = [each for each, keep in zip(sound, worth_it(sound)) if keep]
    chosen = {id(each) for each in kept}
    return [baked(each) for each in every if id(each) not in chosen], kept
