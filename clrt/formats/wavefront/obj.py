"""Reader for Wavefront OBJ, in array operations: one mesh per material.

The format: "Object Files (.obj)", Wavefront, 1995. Points, lines and free-form surfaces are ignored.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from itertools import accumulate
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...file_names import printable
from ...scene.editing import free_name
from ...scene.materials.material_types import Material
from ...threads import in_parallel
from ..polygons import ranges, triangulate
from ..referenced_files import name_of, note_read
from ..text_numbers import reuse_memory
from .distinct import distinct
from .mtl_libraries import read_libraries
from .obj_lines import TABLES, Block, Corners, block_ranges, read_block, without

log = logging.getLogger(__name__)
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
#: Colors are up to 255 instead of 1 if one is as large as this.
BYTE_COLOR = 2


class Tables(NamedTuple):
    """What corners refer to: points (n, 3), texture coordinates (n, 2), normals (n, 3); and the points' colors, (n, 3)
    with NaN for none, or None."""

    points: Floats
    uv: Floats
    normals: Floats
    colors: Floats | None


def parse_obj(path: Path) -> dict[str, dict[str, Any]]:
    """Read meshes by material, with trimesh's names of arrays: vertices (n, 3), faces (m, 3), vertex_normals (n, 3) or
    None, uv (n, 2) or None with v up, vertex_colors (n, 3) or None; and `material`, `material_name`.

    Invalid faces are ignored with a warning. Raises SceneError for other malformed lines, and if all faces are invalid.
    """
    note_read(path)
    reuse_memory()
    blocks = in_parallel(lambda limits: read_block(path, *limits), block_ranges(path))
    points, uv, normals = (_joined([block.tables.pop(key) for block in blocks]) for key in TABLES)
    tables = Tables(points[:, :3], uv, normals, _colors(points[:, 3:]))
    used = [name for block in blocks for _, name in block.materials]
    libraries = [name for block in blocks for name in block.libraries]
    materials = read_libraries(path, libraries, used)
    corners, owners = _valid_faces(path, blocks, tables)
    del blocks
    names, owners = _material_names(["", *used], owners, materials)
    if materials or not libraries:
        _warn_of_undefined(path, names, materials)
    meshes: dict[str, dict[str, Any]] = {}
    for name, part in zip(names, _split(corners, owners, len(names))):
        if len(part.sizes):
            meshes[name] = _mesh(tables, part) | {"material": materials.get(name), "material_name": name}
    if len(meshes) == 1:
        return {name_of(path): mesh for mesh in meshes.values()}
    return {name or free_name(name_of(path), meshes): mesh for name, mesh in meshes.items()}


def _joined(tables: list[Floats]) -> Floats:
    """Return the rows of tables, with NaN in columns that a table does not have."""
    widths = {table.shape[1] for table in tables if len(table)}
    if len(widths) == 1:
        return np.concatenate([table for table in tables if len(table)])
    width = max(widths, default=3)
    rows = np.full((sum(map(len, tables)), width), np.nan)
    for table, stop in zip(tables, accumulate(map(len, tables))):
        rows[stop - len(table) : stop, : table.shape[1]] = table
    return rows


def _colors(given: Floats) -> Floats | None:
    """Return colors up to 1 from the numbers after the position, NaN for vertices without; None if all are."""
    if given.shape[1] < 3 or np.isnan(given[:, 2]).all():
        return None
    return given / (255 if np.nanmax(given) >= BYTE_COLOR else 1)


def _valid_faces(path: Path, blocks: list[Block], tables: Tables) -> tuple[Corners, Ints]:
    """Return the corners of all valid faces, and how many `usemtl` lines are before each; warn of the others."""
    counts = np.array([block.counts for block in blocks]).reshape(-1, 3)
    corners = _absolute([block.corners for block in blocks], np.cumsum(counts, axis=0) - counts)
    switches, before = [0], 0
    for block in blocks:
        switches += [before + faces for faces, _ in block.materials]
        before += len(block.corners.sizes)
    owners = np.repeat(np.arange(len(switches)), np.diff([*switches, before]))
    for column, table in ((1, tables.uv), (2, tables.normals)):
        if not len(table):  # exporters may leave them out, but not the indices
            corners.indices[:, column] = 0
    faults, bad = [block.fault for block in blocks if block.fault], np.zeros(len(corners.sizes), np.bool_)
    limits = (np.array([1, 0, 0]), counts.sum(axis=0))
    if len(corners.indices) and any(
        column.min() < least or column.max() > most for column, least, most in zip(corners.indices.T, *limits)
    ):
        wrong = (corners.indices < limits[0]) | (corners.indices > limits[1])
        corner, column = np.argwhere(wrong)[0]
        faults.append(_range_fault(int(column), int(corners.indices[corner, column]), int(counts[:, column].sum())))
        bad = np.logical_or.reduceat(wrong.any(axis=1), np.cumsum(corners.sizes) - corners.sizes)
    if faults:
        count = sum(block.bad_faces for block in blocks) + int(bad.sum())
        if bad.all():
            raise SceneError(f"{faults[0]}; repair the file")
        log.warning("%s: ignored: %d invalid faces; the first: %s", path, count, faults[0])
    return without(bad, corners), owners[~bad]


def _absolute(blocks: list[Corners], before: Ints) -> Corners:
    """Join the corners of blocks. before: the number of elements before each block, (n, 3)."""
    indices = []
    for corners, base in zip(blocks, before):
        if corners.relative is not None:
            moved = corners.indices + corners.relative * base
            # Before the first element; 0 would be none for the optional ones.
            moved[:, 1:] -= corners.relative[:, 1:] & (moved[:, 1:] == 0)
            indices.append(moved.astype(np.int32))
        else:
            indices.append(corners.indices)
    sizes = [np.zeros(0, np.int64), *(corners.sizes for corners in blocks)]
    columns = np.concatenate([np.zeros((3, 0), np.int32), *(each.T for each in indices)], axis=1)
    return Corners(columns.T, None, np.concatenate(sizes))


def _range_fault(column: int, index: int, count: int) -> str:
    if column == 0 and index == 0:
        return "a face uses vertex 0, but OBJ counts from 1"
    return f"a face uses {('vertex', 'texture coordinate', 'normal')[column]} {index}, but the file has {count}"


def _material_names(used: list[str], owners: Ints, materials: Mapping[str, Material]) -> tuple[list[str], Ints]:
    """Return the distinct names of materials, and the number of the one of each face.

    used: the names as they follow in the file; owners: which of them each face has. What follows a # belongs to a name
    only if there is such a material.
    """
    names = [printable(" ".join(name.split())) for name in used]
    names = [name if name in materials else name.split(" #")[0].rstrip() for name in names]
    numbers = {name: number for number, name in enumerate(dict.fromkeys(names))}
    return list(numbers), np.array([numbers[name] for name in names])[owners]


def _warn_of_undefined(path: Path, names: list[str], materials: Mapping[str, Material]) -> None:
    missing = sorted(set(names) - materials.keys() - {""})
    if missing:
        shown = ", ".join(f'"{name}"' for name in missing[:5]) + f" and {len(missing) - 5} more" * (len(missing) > 5)
        log.warning("%s: no library defines these materials, which are plain gray: %s", path, shown)


def _split(corners: Corners, owners: Ints, count: int) -> list[Corners]:
    """Return the corners of the faces of each owner, from 0 to `count` − 1, in their order."""
    if count == 1 or (len(owners) and (owners == owners[0]).all()):
        nothing = Corners(corners.indices[:0], None, corners.sizes[:0])
        return [corners if owner in owners[:1] else nothing for owner in range(count)]
    order = np.argsort(owners, kind="stable")
    starts, sizes = (np.cumsum(corners.sizes) - corners.sizes)[order], corners.sizes[order]
    indices = corners.indices[ranges(starts, sizes)]
    stops = np.searchsorted(owners[order], np.arange(count), "right")
    corner_stops = np.concatenate([[0], np.cumsum(sizes)])[stops]
    parts = zip(np.split(indices, corner_stops[:-1]), np.split(sizes, stops[:-1]))
    return [Corners(part, None, part_sizes) for part, part_sizes in parts]


def _mesh(tables: Tables, corners: Corners) -> dict[str, Any]:
    """Return the arrays of a mesh with one vertex per combination of indices."""
    numbers, rows = distinct(corners.indices)
    if (corners.sizes == 3).all():
        faces = numbers.reshape(-1, 3)
    else:
        faces = numbers[triangulate(tables.points, corners.indices[:, 0] - 1, corners.sizes)]
    vertex, uv, normal = rows.T - 1
    colors = None if tables.colors is None else tables.colors[vertex]
    if colors is not None and (without_color := np.isnan(colors).any(axis=1)).any():
        colors = None if without_color.all() else np.where(without_color[:, None], 1.0, colors)
    return {
        "vertices": tables.points[vertex],
        "faces": faces,
        "vertex_normals": _taken(tables.normals, normal),
        "uv": _taken(tables.uv, uv),
        "vertex_colors": colors,
    }


def _taken(table: Floats, places: Ints) -> Floats | None:
    """Return rows of a table, zeros at −1; None if all are −1."""
    if (places < 0).all():
        return None
    if (places >= 0).all():
        return table[places]
    return np.where(places[:, None] < 0, 0.0, table[places])
