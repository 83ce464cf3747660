"""Meshes and scenes of trimesh as scenes: by way of glTF, which carries their transforms, materials and textures."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from ..errors import SceneError
from ..scene.model import CONVERSIONS, Model, Scene as Scene, Source


def is_trimesh(model: object) -> bool:
    """Return whether this is a mesh or scene of trimesh, which need not be installed."""
    kind = type(model)
    return kind.__module__.split(".")[0] == "trimesh" and hasattr(model, "export")


def scene_of(model: object, load: Callable[[Path], Scene]) -> Scene:
    """Return what `load` makes of a .glb file of the model. Raises SceneError if trimesh cannot write one."""
    with _exported(model) as path:
        scene = load(path)
    return replace(scene, source=Source(framing=scene.source.framing if scene.source else None))


def _model_of(model: object) -> Model | None:
    """Return the content of a mesh or scene of trimesh; None for others."""
    if not is_trimesh(model):
        return None
    from .models import read_model  # only such scenes need it

    with _exported(model) as path:
        return read_model(path)


@contextmanager
def _exported(model: object) -> Iterator[Path]:
    """Yield the path of a .glb file of the model, which is removed afterwards, and is not named in errors."""
    name = f"{type(model).__name__} of trimesh"
    with tempfile.TemporaryDirectory(prefix="clrt-") as folder:
        path = Path(folder) / "trimesh.glb"
        try:
            path.write_bytes(model.export(file_type="glb"))  # type: ignore[attr-defined]
        except (AttributeError, TypeError, ValueError, KeyError, IndexError, ZeroDivisionError) as error:
            raise SceneError(f"{name}: cannot be exported as glTF ({error})") from error
        try:
            yield path
        except SceneError as error:
            raise SceneError([problem.replace(str(path), name) for problem in error.problems]) from None


CONVERSIONS.append(_model_of)
