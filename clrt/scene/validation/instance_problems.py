"""Validation of instances' matrices."""

from __future__ import annotations

import numpy as np

from ..geometry.instancing import meshes_by_id
from ..geometry.transform import transform_faults
from ..model import Instance
from .field_types import FLOAT32_MAX, show


def matrix_problems(placed: list[tuple[int, Instance]]) -> list[str]:
    """Return problems of numbered instances with valid meshes and shapes; each fault is reported for its first one."""
    to_world = np.array([instance.to_world for _, instance in placed]).reshape(-1, 3, 4)
    meshes = meshes_by_id(instance for _, instance in placed)
    extents = {key: np.abs(mesh.vertices).max(axis=0).astype(np.float64) for key, mesh in meshes.items()}
    extent = np.array([extents[id(instance.mesh)] for _, instance in placed]).reshape(-1, 3)
    faults = transform_faults(to_world)
    with np.errstate(all="ignore"):
        reach = np.einsum("kij,kj->ki", np.abs(to_world[..., :3]), extent) + np.abs(to_world[..., 3])
    known = np.any([*faults.values()], axis=0)
    faults["moves the mesh outside the range of float32"] = (reach > FLOAT32_MAX).any(axis=1) & ~known
    problems = []
    for fault, wrong in faults.items():
        if wrong.any():
            i, instance = placed[int(wrong.argmax())]
            matrix = show(tuple(tuple(row) for row in instance.to_world.tolist()))
            more = f" (and {wrong.sum() - 1} more)" if wrong.sum() > 1 else ""
            problems.append(f"instance[{i}] {show(instance.name)}: to_world {matrix} {fault}{more}; repair it")
    return problems
