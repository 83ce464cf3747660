"""The [[instance]] tables of the scene file, which repeat what [[mesh]] tables show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import prod
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...scene.fields.field_types import show, unknown
from ...scene.fields.limits import Ge, Le
from ...scene.geometry.transform import (
    Matrix,
    transform_camera,
    transform_light,
    transform_mesh,
    translation,
)
from ...scene.geometry.transform_faults import transform_faults
from ...scene.materials.material_types import Material
from ...scene.model import Instance, Model
from .placement import Transform

#: Maximum number of instances per table.
MOST_INSTANCES = 2_000_000


@dataclass(frozen=True, kw_only=True)
class Repeat(Transform):
    """Keys of an entry of `repeat`: `count` copies, each placed relative to the one before it."""

    count: Annotated[int, Ge(1), Le(MOST_INSTANCES)]


@dataclass(frozen=True, kw_only=True)
class InstanceTable(Transform):
    """Keys of [[instance]]; the entries of its `repeat` are read separately."""

    mesh: Any  # a string; its problem lists the known names
    name: str | None = None
    material: str | None = None
    repeat: Any = ()


class Copies(NamedTuple):
    """Copies of a model's parts, one for each of `matrices` (n, 4, 4). material, name: replace the parts' own."""

    matrices: NDArray[np.float64]
    material: Material | None
    name: str | None

    def of(self, parts: Sequence[Instance]) -> list[Instance]:
        """Return the copies of these parts."""
        return [
            replace(moved(each, matrix), material=self.material or each.material, name=self.name or each.name)
            for matrix in self.matrices
            for each in parts
        ]


class InstanceReader:
    """Instances by the names of the mesh tables that they refer to."""

    def __init__(self) -> None:
        self._shown: dict[str, list[list[Instance]]] = {}

    def add(self, name: str | None, shown: Model) -> None:
        """Register what a mesh table of this name, or of none, shows; an empty model if the table is invalid."""
        if name is not None:
            self._shown.setdefault(name, []).append(parts_to_copy(shown))

    def problems(self, mesh: object, where: str) -> list[str]:
        """Return a problem unless exactly one table has the name `mesh`."""
        tables = self._shown.get(str(mesh), [])
        wrong = f"is the name of {len(tables)} meshes; rename them" if tables else unknown(mesh, self._shown)
        return [] if len(tables) == 1 else [f"{where}.mesh: {show(mesh)} {wrong}"]

    def parts(self, table: InstanceTable) -> list[Instance]:
        """Return what the table's mesh shows."""
        return self._shown.get(str(table.mesh), [[]])[0]

    def read(
        self,
        table: InstanceTable,
        repeats: Sequence[Repeat],
        material: Material | None,
        where: str,
    ) -> Copies:
        """Return the copies of what the mesh shows; raises SceneError for invalid transforms."""
        if (count := prod(repeat.count for repeat in repeats)) > MOST_INSTANCES:
            raise SceneError(
                f"{where}.repeat: makes {count} copies; reduce the counts to at most {MOST_INSTANCES} in all"
            )
        matrices = table.to_world(where)[None]
        for i, repeat in enumerate(repeats):
            matrices = repeated(matrices, repeat.to_world(f"{where}.repeat[{i}]"), repeat.count)
        for fault, found in transform_faults(matrices[:, :3]).items():
            if found.any():
                copy = f", of copy {found.argmax()}," if found.size > 1 else ""
                raise SceneError(f"{where}: its transform{copy} {fault}; write a nonzero scale")
        return Copies(matrices, material, table.name)


def parts_to_copy(model: Model) -> list[Instance]:
    """Return a model's meshes, as instances, and its instances."""
    return [Instance(mesh, name=mesh.name) for mesh in model.meshes] + model.instances


def repeated(matrices: NDArray[np.float64], step: Matrix, count: int) -> NDArray[np.float64]:
    """Return the matrices (n, 4, 4) and count − 1 copies of them, each `step` after the last: (count·n, 4, 4)."""
    copies = [matrices]
    with np.errstate(all="ignore"):  # the caller reports overflow
        for _ in range(count - 1):
            copies.append(step @ copies[-1])
    return np.concatenate(copies)


def placed(model: Model, matrix: Matrix, material: Material | None, others: dict[str, Material]) -> Model:
    """Apply an affine matrix to a model, without its animation. material: replaces its own; others: replacements by
    their own names. The result's coordinates are the file's, as the matrix transforms them, and its center is 0."""
    matrix = matrix @ translation(model.center)
    meshes = [
        transform_mesh(replace(mesh, material=others.get(mesh.material_name, material or mesh.material)), matrix)
        for mesh in model.meshes
    ]
    instances = [
        replace(moved(each, matrix), material=others.get(each.mesh.material_name, material or each.material))
        for each in model.instances
    ]
    cameras = {name: transform_camera(camera, matrix) for name, camera in model.cameras.items()}
    lights = [transform_light(light, matrix) for light in model.lights]
    emitters = [transform_mesh(mesh, matrix) for mesh in model.emitters]
    return replace(
        model,
        meshes=meshes,
        instances=instances,
        cameras=cameras,
        lights=lights,
        emitters=emitters,
        animation=None,
        center=(0.0, 0.0, 0.0),
    )


def moved(instance: Instance, matrix: Matrix) -> Instance:
    """Return the instance transformed by a further affine matrix."""
    return replace(instance, to_world=(matrix @ np.vstack([instance.to_world, [0.0, 0.0, 0.0, 1.0]]))[:3])
