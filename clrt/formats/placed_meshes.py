"""Meshes that a file places, once or several times, as meshes and instances of a scene."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..scene.geometry.instancing import baked, worth_it
from ..scene.geometry.transform import Matrix, transform_mesh
from ..scene.geometry.transform_faults import transform_faults
from ..scene.model import Instance, Mesh


def shown(places: Iterable[tuple[Mesh, Matrix]]) -> tuple[list[Mesh], list[Instance]]:
    """Split placed meshes into meshes in world coordinates, and instances where these save memory.

    A singular matrix is accepted, as exporters use it to hide objects; its mesh is not instanced.
    """
    every = list(places)
    to_world = np.array([matrix[:3] for _, matrix in every]).reshape(-1, 3, 4)
    flat = np.any([*transform_faults(to_world).values()], axis=0)
    sound = [
        None if is_flat else Instance(mesh, matrix[:3], name=mesh.name) for (mesh, matrix), is_flat in zip(every, flat)
    ]
    instances = [each for each in sound if each is not None]
    kept = [each for each, keep in zip(instances, worth_it(instances)) if keep]
    chosen = {id(each) for each in kept}
    meshes = [
        transform_mesh(mesh, matrix) if instance is None else baked(instance)
        for (mesh, matrix), instance in zip(every, sound)
        if id(instance) not in chosen
    ]
    return meshes, kept
