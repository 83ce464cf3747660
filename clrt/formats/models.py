"""Model file reading: a reader for each format, and what is alike for those without materials of their own.

To add a format: write its reader, and its entry in FORMATS, where the scene file, `load` and the command line find it.

Parsers name arrays as trimesh does. They may pass on NaN and invalid indices, so all they return is validated here.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from ..file_names import StrPath
from ..scene.geometry.instancing import baked
from ..scene.geometry.normals import Normals, choose_normals
from ..scene.materials.material_types import Diffuse
from ..scene.model import Instance, Mesh, Model, Vector
from .far_origin import far_center
from .images.image_reader import linear_from_srgb
from .model_choice import DEFAULT, ModelChoice
from .placed_meshes import shown
from .referenced_files import check_file, name_of

log = logging.getLogger(__name__)


def read_mesh(path: StrPath, normals: Normals = "file") -> list[Mesh]:
    """Return the meshes of a model file, as `read_model` reads them, relative to its center, with its instances as
    further ones."""
    model = read_model(path, normals)
    return model.meshes + [baked(each) for each in model.instances]


def read_model(path: StrPath, normals: Normals = "file", choice: ModelChoice = DEFAULT) -> Model:
    """Read a model file: meshes, one per material, each with at least one triangle and valid arrays, and cameras.

    Polygons are triangulated. `normals`: see `choose_normals`; choice: for glTF and USD files. Raises SceneError naming
    the file, the mesh, and the index or vertex that is wrong.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    read = FORMATS.get(suffix)
    if read is None:
        raise SceneError(f"{path}: a model must be one of {', '.join(SUFFIXES)}; convert it")
    check_file(path, "model")
    if suffix in CHOOSING:
        return read(path, normals, choice)
    if choice != DEFAULT:
        raise SceneError(f"{path}: {choice.given()[0]}: is for glTF files; leave {choice.given()[0]} out")
    return read(path, normals)


def _gltf(path: Path, normals: Normals, choice: ModelChoice) -> Model:
    from .gltf.reader import read_gltf

    return read_gltf(path, normals, choice)


def _usd(path: Path, normals: Normals, choice: ModelChoice) -> Model:
    from .usd.reader import read_usd

    return read_usd(path, normals, choice)


def _obj(path: Path) -> dict[str, Any]:
    from .wavefront.obj import parse_obj

    return {"geometry": parse_obj(path)}


def _ply(path: Path) -> dict[str, Any]:
    from .ply.reader import parse_ply

    return parse_ply(path)


def _stl(path: Path) -> dict[str, Any]:
    from .stl import parse_stl

    return parse_stl(path)


def _off(path: Path) -> dict[str, Any]:
    from .off import parse_off

    return parse_off(path)


def _3mf(path: Path) -> dict[str, Any]:
    from .threemf.reader import parse_3mf

    return parse_3mf(path)


def of_parts(parse: Callable[[Path], dict[str, Any]]) -> Callable[[Path, Normals], Model]:
    """Return a reader from a parser, which returns the keyword arguments of trimesh's classes for one mesh (vertices,
    faces, vertex_normals, uv, vertex_colors), or for several by name in `geometry`.

    It also returns which axis is `up` unless it is y, the `unit` unless it is m, and `places`, pairs of a mesh's name
    and a matrix (4, 4), unless each is placed once as it is. It raises SceneError for a malformed file.
    """

    def read(path: Path, normals: Normals) -> Model:
        try:
            with np.errstate(all="ignore"):  # values that are not finite are reported
                parts = parse(path)
                center = (0.0, 0.0, 0.0) if "places" in parts else _center(_pieces(path, parts).values())
                meshes, instances = _placed(_meshes(path, parts, normals, center), parts.get("places"))
                up, unit = parts.get("up", "y"), parts.get("unit", "m")
                return Model(meshes=meshes, instances=instances, up=up, unit=unit, center=center)
        except SceneError as error:
            raise SceneError([f"{path}: {problem}" for problem in error.problems]) from None

    return read


USD = (".usd", ".usda", ".usdc", ".usdz")
#: Readers of model files by suffix, which raise SceneError naming the file.
FORMATS: dict[str, Callable[..., Model]] = {
    ".glb": _gltf,
    ".gltf": _gltf,
    ".obj": of_parts(_obj),
    ".ply": of_parts(_ply),
    ".stl": of_parts(_stl),
    ".off": of_parts(_off),
    ".3mf": of_parts(_3mf),
    **dict.fromkeys(USD, _usd),
}
SUFFIXES = tuple(FORMATS)
#: Formats whose readers' last argument is a ModelChoice.
CHOOSING = {".glb", ".gltf", *USD}


def _pieces(path: Path, parts: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Return trimesh's keyword arguments by mesh, of those that have triangles."""
    several = parts.get("geometry", {name_of(path): parts})
    return {name: piece for name, piece in several.items() if _size(piece.get("faces"))}


def _center(pieces: Iterable[dict[str, Any]]) -> Vector:
    """Return the point to subtract from all coordinates, see `far_center`."""
    arrays = [points for piece in pieces if len(points := np.asarray(piece["vertices"]))]
    if not arrays:
        return (0.0, 0.0, 0.0)
    # Per column: numpy's min(axis=0) of three columns takes twenty times as long.
    low, high = ([[end(column) for column in points.T] for points in arrays] for end in (np.min, np.max))
    return far_center(np.min(low, axis=0), np.max(high, axis=0))


def _meshes(path: Path, parts: dict[str, Any], normals: Normals, center: Vector) -> list[Mesh]:
    """Build meshes from trimesh's keyword arguments for one mesh or for several."""
    pieces = _pieces(path, parts)
    if not pieces:
        raise SceneError("contains no triangles (points and lines are ignored); export a triangle mesh")
    meshes, problems = [], []
    for name, piece in pieces.items():
        try:
            meshes.append(_mesh(path, str(name), piece, normals, center))
        except SceneError as error:
            problems += error.problems
    if problems:
        raise SceneError(problems)
    return meshes


def _placed(
    meshes: list[Mesh], places: list[tuple[str, NDArray[np.float64]]] | None
) -> tuple[list[Mesh], list[Instance]]:
    """Return the meshes in world coordinates, or as instances where these save memory."""
    if places is None:
        return meshes, []
    by_name = {mesh.name: mesh for mesh in meshes}
    return shown((by_name[name], matrix) for name, matrix in places if name in by_name)


def _mesh(path: Path, name: str, piece: dict[str, Any], normals: Normals, center: Vector) -> Mesh:
    """Build one mesh from trimesh's arrays minus `center`, with its indices validated before use."""
    points = np.subtract(piece["vertices"], center, dtype=np.float64) if any(center) else piece["vertices"]
    vertices = np.ascontiguousarray(points, np.float32)
    stored = piece.get("vertex_normals")
    stored = None if stored is None else np.ascontiguousarray(stored, np.float32)
    uv = None if piece.get("uv") is None else _downward(np.asarray(piece["uv"], np.float32))
    colors = _linear_colors(piece.get("vertex_colors"))
    plain = Diffuse() if colors is None else Diffuse(color=(1.0, 1.0, 1.0))
    material = piece.get("material") or plain
    if uv is None and material.textures():
        log.warning('%s: mesh "%s" has no texture coordinates; the textures of its material are ignored', path, name)
        material = material.without_textures()
    mesh = Mesh(
        vertices,
        piece["faces"],
        material,
        name=name,
        material_name=piece.get("material_name", ""),
        uv=uv,
        colors=colors,
    )
    mesh.normals = choose_normals(normals, vertices, mesh.faces, stored)
    return mesh


def _downward(uv: NDArray[np.float32]) -> NDArray[np.float32]:
    """Convert texture coordinates (n, k) with v upwards, as these formats have them, or with u alone, to (n, 2)."""
    v = uv[:, 1] if uv.shape[1] > 1 else np.zeros(len(uv), np.float32)
    return np.nan_to_num(np.stack([uv[:, 0], 1 - v], axis=1))


def _linear_colors(colors: Any) -> NDArray[np.float32] | None:
    """Convert these formats' vertex colors, sRGB-encoded and up to 255 if integers, to linear; alpha is kept if some
    vertices are transparent, but not all, as some exporters leave it at 0."""
    if colors is None:
        return None
    given = np.asarray(colors)
    encoded = np.asarray(given / (255 if np.issubdtype(given.dtype, np.integer) else 1), np.float32)
    encoded = np.nan_to_num(encoded).clip(0, 1)
    linear = linear_from_srgb(encoded[:, :3])
    alpha = encoded[:, 3:4]
    return np.concatenate([linear, alpha], axis=1) if alpha.any() and (alpha < 1).any() else linear


def _size(array: Any) -> int:
    return 0 if array is None else len(array)
