"""Where the parts of a scene were read from, so that a scene file can say so again (scene.writing).

Parts are known by identity: an array that was changed, or made in Python, is from nowhere.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .material import Material
from .model import Camera, Instance, Mesh, Model

#: What makes a mesh's shape.
ARRAYS = ("vertices", "faces", "normals", "uv", "uv1", "colors", "tangents")


@dataclass(eq=False)
class Origin:
    """A [[mesh]] or [[instance]] table, its file with an absolute path. parts: what it showed; own: the materials that
    these have without the table's."""

    table: Mapping[str, Any]
    parts: Sequence[Mesh | Instance]
    own: Sequence[Material | None]


@dataclass(eq=False)
class Source:
    """meshes, instances: tables in their order. files: pictures of textures and images of skies, each with its file.
    cameras: those of model files."""

    meshes: list[Origin] = field(default_factory=list)
    instances: list[Origin] = field(default_factory=list)
    files: list[tuple[object, Path]] = field(default_factory=list)
    cameras: dict[str, Camera] = field(default_factory=dict)

    @property
    def paths(self) -> list[Path]:
        """The files of meshes, textures and skies."""
        return [*(origin.table["file"] for origin in self.meshes if "file" in origin.table),
                *(path for _, path in self.files)]

    def file_of(self, content: object) -> Path | None:
        """Where this very picture or image was read."""
        return next((path for each, path in self.files if each is content), None)


def source_of_model(path: Path, model: Model) -> Source:
    """Of a bare model."""
    parts = parts_of(model)
    return Source([Origin({"file": path.resolve()}, parts, list(map(material_of, parts)))], cameras=model.cameras)


def parts_of(model: Model) -> list[Mesh | Instance]:
    """Its meshes, then its instances."""
    return [*model.meshes, *model.instances]


def material_of(part: Mesh | Instance) -> Material:
    """What it is seen in."""
    return part.material or part.mesh.material if isinstance(part, Instance) else part.material


def shape_of(part: Mesh | Instance) -> tuple[object, ...]:
    """What is the same of two parts only where they are the same arrays in the same place, by the same name."""
    if isinstance(part, Instance):
        return (part.name, id(part.to_world), *shape_of(part.mesh))
    return (part.name, *(id(getattr(part, name)) for name in ARRAYS))
