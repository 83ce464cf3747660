"""Files that the parts of a scene were read from, so that a scene file can refer to them (scene.writing).

Parts are compared by identity: an array that was changed, or made in Python, has no source.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .materials.material import Material
from .model import Camera, Instance, Mesh, Model

#: Arrays that define a mesh's shape.
ARRAYS = ("vertices", "faces", "normals", "uv", "uv1", "colors", "tangents")


@dataclass(eq=False)
class Origin:
    """A [[mesh]] or [[instance]] table, with the file's absolute path. parts: what it showed; own: the materials of
    these without the table's."""

    table: Mapping[str, Any]
    parts: Sequence[Mesh | Instance]
    own: Sequence[Material | None]


@dataclass(eq=False)
class Source:
    """Sources of a scene. meshes, instances: tables in their order. files: textures' pictures and environment maps,
    each with its file. cameras: those of model files."""

    meshes: list[Origin] = field(default_factory=list)
    instances: list[Origin] = field(default_factory=list)
    files: list[tuple[object, Path]] = field(default_factory=list)
    cameras: dict[str, Camera] = field(default_factory=dict)

    @property
    def paths(self) -> list[Path]:
        """Return the files of meshes, textures and environment maps."""
        return [*(origin.table["file"] for origin in self.meshes if "file" in origin.table),
                *(path for _, path in self.files)]

    def file_of(self, content: object) -> Path | None:
        """Return the file that this very picture or image object was read from."""
        return next((path for each, path in self.files if each is content), None)


def source_of_model(path: Path, model: Model, placing: Mapping[str, Any]) -> Source:
    """Return the source of a bare model, to which the transform keys `placing` of a [[mesh]] were applied."""
    parts = parts_of(model)
    origin = Origin({"file": path.resolve(), **placing}, parts, list(map(material_of, parts)))
    return Source([origin], cameras=model.cameras)


def parts_of(model: Model) -> list[Mesh | Instance]:
    """Return the model's meshes, then its instances."""
    return [*model.meshes, *model.instances]


def material_of(part: Mesh | Instance) -> Material:
    """Return the material that the part is rendered with."""
    return part.material or part.mesh.material if isinstance(part, Instance) else part.material


def shape_of(part: Mesh | Instance) -> tuple[object, ...]:
    """Return a key that is equal for two parts only if they have the same arrays, transform and name."""
    if isinstance(part, Instance):
        return (part.name, id(part.to_world), *shape_of(part.mesh))
    return (part.name, *(id(getattr(part, name)) for name in ARRAYS))
