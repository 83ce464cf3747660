"""Meshes and scenes of trimesh as scenes: by way of glTF, which carries their transforms, materials and textures."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from ..errors import SceneError
from ..scene.model import Scene


def is_trimesh(model: object) -> bool:
    """Return whether this is a mesh or scene of trimesh, which need not be installed."""
    kind = type(model)
    return kind.__module__.split(".")[0] == "trimesh" and hasattr(model, "export")


def scene_of(model: object, load: Callable[[Path], Scene]) -> Scene:
    """Return what `load` makes of a .glb file of the model. Raises SceneError if trimesh cannot write one."""
    with tempfile.TemporaryDirectory(prefix="clrt-") as folder:
        path = Path(folder) / "trimesh.glb"
        try:
            path.write_bytes(model.export(file_type="glb"))  # type: ignore[attr-defined]
        except (AttributeError, TypeError, ValueError, KeyError, IndexError, ZeroDivisionError) as error:
            raise SceneError(f"{type(model).__name__} of trimesh: cannot be exported as glTF ({error})") from error
        return replace(load(path), source=None)
