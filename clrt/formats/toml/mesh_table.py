"""The [[mesh]] table of the scene file."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from ...errors import ObjectError, SceneError
from ...scene.axes_and_units import CONVERTED, Axis, LightUnit, Unit
from ...scene.fields.field_types import show
from ...scene.fields.limits import Ge, Le, Lt
from ...scene.geometry.creases import creased
from ...scene.geometry.instancing import meshes_by_id
from ...scene.geometry.normals import Normals, choose_normals
from ...scene.geometry.transform import Matrix
from ...scene.materials.material_types import Diffuse
from ...scene.model import Instance, Mesh, Model, Vector
from ...scene.model_pose import with_poses
from ...scene.provenance import parts_of
from ..model_choice import DEFAULT, ModelChoice
from ..models import read_model
from ..up_axis import upright
from .placement import Transform

log = logging.getLogger(__name__)
Vertex = Annotated[int, Ge(0), Lt(2**31)]


@dataclass(frozen=True, kw_only=True)
class MeshTable(Transform):
    """Keys of [[mesh]]; its `motion` is read separately."""

    name: str | None = None
    file: str | None = None
    scene: str | None = None
    variant: str | None = None
    animation: str | None = None
    time: float | None = None
    vertices: tuple[Vector, ...] | None = None
    faces: tuple[tuple[Vertex, Vertex, Vertex], ...] | None = None
    uv: tuple[tuple[float, float], ...] | None = None
    material: str | None = None
    materials: Mapping[str, str] | None = None
    normals: Normals = "file"
    crease_degrees: Annotated[float, Ge(0), Le(180)] | None = None
    lights: bool = False
    light_unit: LightUnit | None = None
    ignore_extensions: tuple[str, ...] | None = None
    visible: bool = True
    up: Axis = "y"
    unit: Unit = "m"
    motion: Any = None

    def to_world(self, where: str) -> Matrix:
        """Return the table's transform, after that of its axes and unit. Raises SceneError as that of `Transform`."""
        return super().to_world(where) @ upright(self.up, self.unit)

    def read(self, folder: Path, where: str) -> Model:
        """Read its file, which is relative to `folder`, or its vertices and faces, untransformed.

        Raises SceneError for a file that cannot be read, indices out of range, no geometry or both kinds, and
        crease_degrees without computed normals.
        """
        if self.crease_degrees is not None and self.normals != "smooth":
            raise SceneError(f'{where}: has crease_degrees, but normals = "{self.normals}"; write normals = "smooth"')
        model = self._read(folder, where)
        return with_poses(model if self.animation is not None else replace(model, animation=None), self._finished)

    def _finished(self, model: Model) -> Model:
        """Return the model with the table's name and creases, without its animation."""
        if self.file is not None and self.name is not None:
            alone = len(model.meshes) + len(model.instances) == 1
            names = [self.name if alone else f"{self.name} {part.name}" for part in parts_of(model)]
            count = len(model.meshes)
            model = replace(
                model,
                meshes=[replace(mesh, name=name) for mesh, name in zip(model.meshes, names)],
                instances=[replace(each, name=name) for each, name in zip(model.instances, names[count:])],
            )
        if self.crease_degrees is None:
            return replace(model, animation=None)
        meshes = {
            number: creased(mesh, self.crease_degrees)
            for number, mesh in meshes_by_id([*model.instances, *map(Instance, model.meshes)]).items()
        }
        return replace(
            model,
            meshes=[meshes[id(mesh)] for mesh in model.meshes],
            instances=[replace(each, mesh=meshes[id(each.mesh)]) for each in model.instances],
            animation=None,
        )

    def _read(self, folder: Path, where: str) -> Model:
        inline = self.vertices is not None or self.faces is not None or self.uv is not None
        if self.file is not None and inline:
            raise SceneError(f"{where}: has both a file and vertices, faces or uv; keep one of them")
        choice = ModelChoice(
            scene=self.scene,
            variant=self.variant,
            animation=self.animation,
            time=self.time,
            light_unit=self.light_unit,
            ignore_extensions=self.ignore_extensions,
        )
        if self.file is not None:
            return self._from_file(self.file, choice, folder, where)
        if choice != DEFAULT:
            raise SceneError(f"{where}: has {choice.given()[0]}, but no file; leave it out, or write a file")
        if self.vertices is None or self.faces is None:
            missing = "faces" if self.vertices else "vertices" if self.faces else "file"
            raise SceneError(f"{where}: {missing} is missing; write a file, or vertices and faces")
        with np.errstate(over="ignore"):
            vertices = np.array(self.vertices, np.float32).reshape(-1, 3)
        faces = np.array(self.faces, np.int32).reshape(-1, 3)
        uv = None if self.uv is None else np.array(self.uv, np.float32).reshape(-1, 2)
        name = self.name or "mesh"
        try:
            mesh = Mesh(vertices, faces, Diffuse(), name=name, uv=uv)
        except ObjectError as error:
            raise SceneError(error.named(f"{where} {show(name)}")) from None
        mesh.normals = choose_normals(self.normals, vertices, faces, None)
        return Model(meshes=[mesh])

    def _from_file(self, file: str, choice: ModelChoice, folder: Path, where: str) -> Model:
        try:
            model = read_model(folder / file, self.normals, choice)
        except SceneError as error:
            raise SceneError([f"{where}.file: {problem}" for problem in error.problems]) from None
        if self.lights and model.converted_from is not None:
            log.warning(
                '%s: %s: %s; light_unit = "radiometric" takes them as W/sr and W/m²',
                where,
                file,
                CONVERTED[model.converted_from],
            )
        return model
