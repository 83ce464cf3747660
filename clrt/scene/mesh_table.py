"""The [[mesh]] table of the scene file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from annotated_types import Ge, Lt

from ..errors import SceneError
from .fields import show
from .materials import Diffuse
from .meshes import read_model
from .model import Mesh, Model, Vector
from .normals import Normals, choose_normals
from .transform import Matrix, rotation, scaling, translation
from .validate import mesh_problems

Row = tuple[float, float, float, float]
Vertex = Annotated[int, Ge(0), Lt(2**31)]


@dataclass(frozen=True, kw_only=True)
class MeshTable:
    """The keys of [[mesh]]. A point is scaled, then turned about the fixed x, y and z axes in this order, then moved;
    or it goes by `matrix`, four rows."""

    name: str | None = None
    file: str | None = None
    vertices: tuple[Vector, ...] | None = None
    faces: tuple[tuple[Vertex, Vertex, Vertex], ...] | None = None
    uv: tuple[tuple[float, float], ...] | None = None
    material: str | None = None
    materials: Mapping[str, str] | None = None
    normals: Normals = "file"
    translate: Vector = (0.0, 0.0, 0.0)
    scale: Vector = (1.0, 1.0, 1.0)
    rotate_degrees: Vector = (0.0, 0.0, 0.0)
    matrix: tuple[Row, Row, Row, Row] | None = None

    def to_world(self, where: str) -> Matrix:
        """The table's transform. Raises SceneError if it is given twice or is not affine."""
        if self.matrix is None:
            return translation(self.translate) @ rotation(self.rotate_degrees) @ scaling(self.scale)
        plain = MeshTable()
        if any(getattr(self, key) != getattr(plain, key) for key in ("translate", "scale", "rotate_degrees")):
            raise SceneError(f"{where}: has a matrix and translate, scale or rotate_degrees; keep one of them")
        if self.matrix[3] != (0.0, 0.0, 0.0, 1.0):
            raise SceneError(f"{where}.matrix[3]: {show(self.matrix[3])} is not affine; write [0, 0, 0, 1]")
        return np.array(self.matrix, np.float64)

    def read(self, folder: Path, where: str) -> Model:
        """What is in its file, which is relative to `folder`, or in its vertices and faces, untransformed.

        Raises SceneError for a file that cannot be read, indices out of range, and no geometry or two.
        """
        inline = self.vertices is not None or self.faces is not None or self.uv is not None
        if self.file is not None and inline:
            raise SceneError(f"{where}: has a file and vertices, faces or uv; keep one of them")
        if self.file is not None:
            return self._from_file(self.file, folder, where)
        if self.vertices is None or self.faces is None:
            missing = "faces" if self.vertices else "vertices" if self.faces else "file"
            raise SceneError(f"{where}: {missing} is missing; write a file, or vertices and faces")
        with np.errstate(over="ignore"):
            vertices = np.array(self.vertices, np.float32).reshape(-1, 3)
        faces = np.array(self.faces, np.int32).reshape(-1, 3)
        uv = None if self.uv is None else np.array(self.uv, np.float32).reshape(-1, 2)
        mesh = Mesh(vertices, faces, Diffuse(), name=self.name or "mesh", uv=uv)
        problems = mesh_problems(mesh, where)
        if problems:
            raise SceneError(problems)
        mesh.normals = choose_normals(self.normals, vertices, faces, None)
        return Model(meshes=[mesh])

    def _from_file(self, file: str, folder: Path, where: str) -> Model:
        try:
            model = read_model(folder / file, self.normals)
        except SceneError as error:
            raise SceneError([f"{where}.file: {problem}" for problem in error.problems]) from None
        if self.name is not None:
            for mesh in model.meshes:
                mesh.name = self.name if len(model.meshes) == 1 else f"{self.name} {mesh.name}"
        return model
