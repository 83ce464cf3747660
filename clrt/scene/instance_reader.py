"""The [[instance]] tables of the scene file, which show again what [[mesh]] tables show."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..errors import SceneError
from .fields import show, unknown
from .materials import Material
from .model import Instance, Model
from .placing import Placing
from .transform import Matrix, transform_camera, transform_faults, transform_mesh


@dataclass(frozen=True, kw_only=True)
class InstanceTable(Placing):
    """The keys of [[instance]]."""

    mesh: str
    name: str | None = None
    material: str | None = None


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

    def read(self, table: InstanceTable, material: Material | None, where: str) -> list[Instance]:
        """One for each mesh that the table's mesh shows. Raises SceneError for a transform that cannot be."""
        matrix = table.to_world(where)
        for fault, found in transform_faults(matrix[None, :3]).items():
            if found[0]:
                raise SceneError(f"{where}: its transform {fault}; write a scale without 0")
        shown = self._shown.get(table.mesh, [[]])[0]
        return [replace(moved(each, matrix), material=material or each.material, name=table.name or each.name)
                for each in shown]


def placed(model: Model, matrix: Matrix, material: Material | None, others: dict[str, Material]) -> Model:
    """A model under an affine matrix: in the material, if there is one, or in `others` by its own's name."""
    meshes = [transform_mesh(replace(mesh, material=others.get(mesh.material_name, material or mesh.material)), matrix)
              for mesh in model.meshes]
    instances = [replace(moved(each, matrix), material=others.get(each.mesh.material_name, material or each.material))
                 for each in model.instances]
    cameras = {name: transform_camera(camera, matrix) for name, camera in model.cameras.items()}
    return Model(meshes=meshes, instances=instances, cameras=cameras)


def moved(instance: Instance, matrix: Matrix) -> Instance:
    """The instance under a further affine matrix."""
    return replace(instance, to_world=(matrix @ np.vstack([instance.to_world, [0.0, 0.0, 0.0, 1.0]]))[:3])
