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
from ...scene.model import Instance, Model, Vector
from .placement import Transform

#: Maximum number of instances per table.
MOST_INSTANCES = 2_000_000


@dataclass(frozen=True, kw_only=True)
class Repeat(Transform):
    """Keys of an entry of `repeat`: `count` copies, each placed relative to the one before it."""

    count: Annotated[int, Ge(1), Le(MOST_INSTANCES)]


@dataclass(frozen=True, kw_only=True)
class InstanceTable(Transform):
    """Keys of [[instance]]; the entries of its `repeat`, and its `motion`, are read separately."""

    mesh: Any  # a string; its problem lists the known names
    name: str | None = None
    material: str | None = None
    repeat: Any = ()
    motion: Any = None


class Copies(NamedTuple):
    """Copies of a model's parts, one for each of `matrices` (n, 4, 4). material, name: replace the parts' own. ends:
    the matrices at the end of the exposure, the same if they do not move; pivot: the parts' point that moves in a
    straight line."""

    matrices: NDArray[np.float64]
    material: Material | None
    name: str | None
    ends: NDArray[np.float64]
    pivot: Vector = (0.0, 0.0, 0.0)

    def of(self, parts: Sequence[Instance]) -> list[Instance]:
        """Return the copies of these parts."""
        return [
            replace(
                moved(each, matrix, end, self.pivot),
                material=self.material or each.material,
                name=self.name or each.name,
            )
            for matrix, end in zip(self.matrices, self.ends)
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
        end: InstanceTable | None = None,
        pivot: Vector = (0.0, 0.0, 0.0),
    ) -> Copies:
        """Return the copies of what the mesh shows; raises SceneError for invalid transforms. end, pivot: the table at
        the end of the exposure, and its pivot, if it has a motion."""
        if (count := prod(repeat.count for repeat in repeats)) > MOST_INSTANCES:
            raise SceneError(
                f"{where}.repeat: makes {count} copies; reduce the counts to at most {MOST_INSTANCES} in all"
            )
        matrices = _matrices(table, repeats, where, where)
        ends = matrices if end is None else _matrices(end, repeats, where, f"{where}.motion")
        return Copies(matrices, material, table.name, ends, pivot)


def _matrices(table: Transform, repeats: Sequence[Repeat], where: str, own: str) -> NDArray[np.float64]:
    """Return the matrices of all copies; own: the name of the table with their transform."""
    matrices = table.to_world(own)[None]
    for i, repeat in enumerate(repeats):
        matrices = repeated(matrices, repeat.to_world(f"{where}.repeat[{i}]"), repeat.count)
    for fault, found in transform_faults(matrices[:, :3]).items():
        if found.any():
            copy = f", of copy {found.argmax()}," if found.size > 1 else ""
            raise SceneError(f"{own}: its transform{copy} {fault}; write a nonzero scale")
    return matrices


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


def placed(
    model: Model,
    matrix: Matrix,
    material: Material | None,
    others: dict[str, Material],
    end: Matrix | None = None,
    pivot: Vector = (0.0, 0.0, 0.0),
) -> Model:
    """Apply an affine matrix to a model, without its animation. material: replaces its own; others: replacements by
    their own names. The result's coordinates are the file's, as the matrix transforms them, and its center is 0. end:
    the matrix at the end of the exposure, of a model that moves, whose meshes become instances; pivot: its point that
    moves in a straight line."""
    center = translation(model.center)
    matrix, end = matrix @ center, None if end is None else end @ center
    meshes = [
        replace(mesh, material=others.get(mesh.material_name, material or mesh.material)) for mesh in model.meshes
    ]
    instances = [
        replace(each, material=others.get(each.mesh.material_name, material or each.material))
        for each in model.instances
    ]
    cameras = {name: transform_camera(camera, matrix) for name, camera in model.cameras.items()}
    if end is None:
        meshes = [transform_mesh(mesh, matrix) for mesh in meshes]
    else:
        instances = [*(Instance(mesh, name=mesh.name) for mesh in meshes), *instances]
        own = center @ translation((-pivot[0], -pivot[1], -pivot[2]))
        instances = [replace(each, pivot=(own @ _square(each.to_world))[:3]) for each in instances]
        ends = {name: transform_camera(camera, end) for name, camera in model.cameras.items()}
        meshes, cameras = [], {name: camera.moving_to(ends[name]) for name, camera in cameras.items()}
    instances = [moved(each, matrix, end) for each in instances]
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


def moved(instance: Instance, matrix: Matrix, end: Matrix | None = None, pivot: Vector = (0.0, 0.0, 0.0)) -> Instance:
    """Return the instance transformed by a further affine matrix; end: the matrix at the end of the exposure, if it
    changes; pivot: the point that this moves in a straight line, unless the instance has one of its own."""
    to_world, last = _square(instance.to_world), _square(instance.to_world_end, instance.to_world)
    further = matrix if end is None else end
    if instance.to_world_end is None and np.array_equal(matrix, further):
        return replace(instance, to_world=(matrix @ to_world)[:3])
    around = instance.pivot
    if instance.to_world_end is None and around is None:
        around = (translation((-pivot[0], -pivot[1], -pivot[2])) @ to_world)[:3]
    return replace(instance, to_world=(matrix @ to_world)[:3], to_world_end=(further @ last)[:3], pivot=around)


def _square(matrix: NDArray[np.float64] | None, default: NDArray[np.float64] | None = None) -> Matrix:
    """Return an affine matrix (3, 4) as (4, 4)."""
    rows = default if matrix is None else matrix
    assert rows is not None
    return np.vstack([rows, [0.0, 0.0, 0.0, 1.0]])
