"""Read a scene: a TOML scene file, or a bare model under a default camera and sky."""

from __future__ import annotations

import tomllib
from pathlib import Path

from ..errors import SceneError
from .framing import frame
from .meshes import SUFFIXES, read_mesh
from .model import Camera, Mesh, Scene
from .sky import SUN, default_sky
from .toml import SceneReader
from .validate import scene_problems


def load(path: str | Path) -> Scene:
    """The scene in a .toml file, or a model file's meshes with a camera that frames them, a sky and a sun.

    A glTF model's own first camera is used if it has one. Raises one SceneError with all mistakes in the file, each as
    "FILE: object: value is wrong; remedy".
    """
    path = Path(path)
    if not path.is_file():
        raise SceneError(f"{path}: {'is a folder, not a scene' if path.is_dir() else 'no such scene file'}")
    if path.suffix.lower() == ".toml":
        return _load_toml(path)
    if path.suffix.lower() not in SUFFIXES:
        raise SceneError(f"{path}: a scene must be one of .toml, {', '.join(SUFFIXES)}; convert it")
    meshes, camera = _load_model(path)
    scene = Scene(meshes=meshes, camera=camera, environment=default_sky(), lights=[SUN], name=path.stem)
    _refuse(path, scene_problems(scene))
    return scene


def _load_model(path: Path) -> tuple[list[Mesh], Camera]:
    """A bare model's meshes, and its own camera or one that frames them."""
    if path.suffix.lower() in (".glb", ".gltf"):
        from .gltf import read_gltf
        model = read_gltf(path)
        return model.meshes, model.camera or frame(model.meshes)
    meshes = read_mesh(path)
    return meshes, frame(meshes)


def _load_toml(path: Path) -> Scene:
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise SceneError(f"{path}: is not valid TOML: {error}") from None
    reader = SceneReader(path, document)
    scene = reader.scene()
    _refuse(path, reader.problems + scene_problems(scene))
    return scene


def _refuse(path: Path, problems: list[str]) -> None:
    if problems:
        raise SceneError([f"{path}: {problem}" for problem in problems])
