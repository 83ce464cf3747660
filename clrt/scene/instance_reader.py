"""The [[instance]] tables of the scene file, which show again what [[mesh]] tables show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import prod
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from .fields import show, unknown
from .limits import Ge, Le
from .materials import Material
from .model import Instance, Model
from .placing import Placing
from .transform import Matrix, transform_camera, transform_faults, transform_light, transform_mesh


#: That one table may make.
MOST_INSTANCES = 2_000_000


@dataclass(frozen=True, kw_only=True)
class Repeat(Placing):
    """The keys of an entry of `repeat`: so many copies, each placed from the one before it."""

    count: Annotated[int, Ge(1), Le(MOST_INSTANCES)]


@dataclass(frozen=True, kw_only=True)
class InstanceTable(Placing):
    """The keys of [[instance]]; the entries of its `repeat` are read apart."""

    mesh: str
    name: str | None = None
    material: str | None = None
    repeat: Any = ()


class InstanceReader:
    """Knows what mesh tables show, by their names."""

    def __init__(self) -> None:
        self._shown: dict[str, list[list[Instance]]] = {}

    def add(self, name: str | None, shown: Model) -> None:
        """A mesh table of this name, or of none, shows the model; an empty one if the table is wrong."""
        own = [Instance(mesh, name=mesh.name) for mesh in shown.meshes]
        if name is not None:
            self._shown.setdefault(name, []).append(own + shown.instances)

    def problems(self, mesh: object, where: str) -> list[str]:
        """Whether there is not one table of the name `mesh`."""
        tables = self._shown.get(str(mesh), [])
        wrong = f"names {len(tables)} meshes; rename them" if tables else unknown(mesh, self._shown)
        return [] if len(tables) == 1 else [f"{where}.mesh: {show(mesh)} {wrong}"]

    def materials(self, table: InstanceTable) -> list[Material | None]:
        """Those of what the table's mesh shows, without the table's own."""
        return [each.material for each in self._shown.get(str(table.mesh), [[]])[0]]

    def read(self, table: InstanceTable, repeats: Sequence[Repeat], material: Material | None, where: str,
             ) -> list[Instance]:
        """One for each mesh that the table's mesh shows, and their copies. SceneError for transforms that cannot be."""
        if (count := prod(repeat.count for repeat in repeats)) > MOST_INSTANCES:
            raise SceneError(f"{where}.repeat: makes {count} copies; write counts of at most {MOST_INSTANCES} in all")
        matrices = table.to_world(where)[None]
        for i, repeat in enumerate(repeats):
            matrices = repeated(matrices, repeat.to_world(f"{where}.repeat[{i}]"), repeat.count)
        for fault, found in transform_faults(matrices[:, :3]).items():
            if found.any():
                copy = f", of copy {found.argmax()}," if found.size > 1 else ""
                raise SceneError(f"{where}: its transform{copy} {fault}; write a scale without 0")
        shown = self._shown.get(str(table.mesh), [[]])[0]
        return [replace(moved(each, matrix), material=material or each.material, name=table.name or each.name)
                for matrix in matrices for each in shown]


def repeated(matrices: NDArray[np.float64], step: Matrix, count: int) -> NDArray[np.float64]:
    """(n, 4, 4) and count − 1 copies of them, each under one `step` more than those before it: (count·n, 4, 4)."""
    copies = [matrices]
    with np.errstate(all="ignore"):    # what grows beyond all numbers is found by the caller
        for _ in range(count - 1):
            copies.append(step @ copies[-1])
    return np.concatenate(copies)


def placed(model: Model, matrix: Matrix, material: Material | None, others: dict[str, Material]) -> Model:
    """A model under an affine matrix: in the material, if there is one, or in `others` by its own's name."""
    meshes = [transform_mesh(replace(mesh, material=others.get(mesh.material_name, material or mesh.material)), matrix)
              for mesh in model.meshes]
    instances = [replace(moved(each, matrix), material=others.get(each.mesh.material_name, material or each.material))
                 for each in model.instances]
    cameras = {name: transform_camera(camera, matrix) for name, camera in model.cameras.items()}
    return Model(meshes=meshes, instances=instances, cameras=cameras,
                 lights=[transform_light(light, matrix) for light in model.lights])


def moved(instance: Instance, matrix: Matrix) -> Instance:
    """The instance under a further affine matrix."""
    return replace(instance, to_world=(matrix @ np.vstack([instance.to_world, [0.0, 0.0, 0.0, 1.0]]))[:3])
