"""Files that the parts of a scene were read from, so that a scene file can refer to them (scene.writing).

Parts are compared by identity: an array that was changed, or made in Python, has no source.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .materials.material import Material
from .model import Instance, Mesh, Model, Origin, Source

#: Arrays that define a mesh's shape.
ARRAYS = ("vertices", "faces", "normals", "uv", "uv1", "colors", "tangents")


def source_of_model(path: Path, model: Model, placing: Mapping[str, Any], whole: bool = True) -> Source:
    """Return the source of a bare model, to which the transform keys `placing` of a [[mesh]] were applied.

    whole: whether a [[mesh]] would read the same, and not another scene or pose of the file.
    """
    parts = parts_of(model) if whole else []
    origin = Origin({"file": path.resolve(), **placing}, parts, list(map(material_of, parts)))
    return Source([origin], cameras=model.cameras, contents=model.contents)


def parts_of(model: Model) -> list[Mesh | Instance]:
    """Return the model's meshes, then its instances."""
    return [*model.meshes, *model.instances]


def material_of(part: Mesh | Instance) -> Material:
    """Return the material that the part is rendered with."""
    return part.material or part.mesh.material if isinstance(part, Instance) else part.material


def shape_of(part: Mesh | Instance) -> tuple[object, ...]:
    """Return a key that is equal for two parts only if they have the same arrays, transform and name."""
    if isinstance(part, Instance):
        return (part.name, id(part.to_world), id(part.to_world_end), *shape_of(part.mesh))
    return (part.name, *(id(getattr(part, name)) for name in ARRAYS))
