"""Reader for Wavefront OBJ, in array operations if the file is regular: one mesh per material.

The format: "Object Files (.obj)", Wavefront, 1995. Points, lines and free-form surfaces are ignored.
"""

from __future__ import annotations

import logging
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...file_names import printable
from ...scene.editing import free_name
from ...scene.materials.material_types import Material
from ..referenced_files import name_of, note_read
from .mtl import MtlMaterial, left_out, material, read_library
from .mtl_maps import Maps

log = logging.getLogger(__name__)
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def parse_obj(path: Path) -> dict[str, dict[str, Any]]:
    """Read meshes by material, with trimesh's names of arrays: vertices (n, 3), faces (m, 3), vertex_normals (n, 3) or
    None, uv (n, 2) or None with v up, vertex_colors (n, 3) or None; and `material`, `material_name`.

    Raises SceneError for malformed lines and for indices out of range.
    """
    text = absolute_indices(_text(path).replace("\\\n", " "))
    points, normals, uv = _table(text, "v", 3), _table(text, "vn", 3), _table(text, "vt", 1)
    colors = points[:, 3:6] if points.shape[1] >= 6 else None
    libraries = _libraries(path, text)
    groups: dict[str, list[str]] = {}
    pieces = re.split(r"^[ \t]*usemtl\b(.*)$", text, flags=re.MULTILINE) if "usemtl" in text else [text]
    for name, chunk in zip(["", *pieces[1::2]], pieces[::2]):
        groups.setdefault(printable(" ".join(name.split())), []).extend(_lines(chunk, "f"))
    meshes = {}
    for name, lines in groups.items():
        if lines:
            corners, faces = _fans([line.split() for line in lines])
            triples = _indices(corners, (len(points), len(uv), len(normals)))
            numbers, triples = _distinct(triples)
            where = triples.T - 1
            meshes[name] = {
                "vertices": points[where[0], :3],
                "faces": numbers[faces],
                "vertex_normals": _taken(normals, where[2]),
                "uv": _taken(uv, where[1]),
                "vertex_colors": None if colors is None else colors[where[0]],
                "material": libraries.get(name),
                "material_name": name,
            }
    if len(meshes) == 1:
        return {name_of(path): mesh for mesh in meshes.values()}
    return {name or free_name(name_of(path), meshes): mesh for name, mesh in meshes.items()}


def absolute_indices(text: str) -> str:
    """Return the text with relative indices (−1 = the latest vertex so far) made absolute."""
    if not re.search(r"^[ \t]*f.*[ \t/]-", text, re.MULTILINE):
        return text
    counts = {"v": 0, "vt": 0, "vn": 0}
    lines = text.splitlines()
    for number, line in enumerate(lines):
        key, *entries = line.split() or [""]
        if key in counts:
            counts[key] += 1
        elif key == "f":
            corners = [zip(entry.split("/"), counts.values()) for entry in entries]
            lines[number] = "f " + " ".join(
                "/".join(_absolute(index, count) for index, count in corner) for corner in corners
            )
    return "\n".join(lines)


def _absolute(index: str, count: int) -> str:
    """Return an index that counts from 1; one that is not a number is returned as it is, and reported later."""
    return str(count + int(index) + 1) if re.fullmatch(r"-\d{1,15}", index) else index


def _lines(text: str, key: str) -> list[str]:
    """Return the rest of the lines that start with `key`, without comments."""
    return re.findall(rf"^[ \t]*{key}[ \t]+([^#\n]*)", text, re.MULTILINE) if key in text else []


def _table(text: str, key: str, least: int) -> Floats:
    """Return the numbers on the lines of `key`, (n, k): as many as the shortest line has, but at least `least`."""
    rows = [line.split() for line in _lines(text, key)]
    if not rows:
        return np.zeros((0, least))
    shortest = min(map(len, rows))
    try:
        values = np.array(rows if shortest == max(map(len, rows)) else [row[:shortest] for row in rows], np.float64)
    except ValueError:
        values = np.zeros((0, 0))
    if values.ndim != 2 or values.shape[1] < least:
        raise SceneError(f'a line "{key} {" ".join(_odd(rows, least))[:60]}" needs {least} numbers; repair the file')
    return values


def _odd(rows: list[list[str]], least: int) -> list[str]:
    """Return the first row without enough numbers."""

    def is_odd(row: list[str]) -> bool:
        try:
            return len(list(map(float, row))) < least
        except ValueError:
            return True

    return next(filter(is_odd, rows), [])


def _fans(polygons: list[list[str]]) -> tuple[list[str], Ints]:
    """Return all corners, and the indices into them of each triangle, (m, 3); polygons become triangle fans."""
    sizes = np.array(list(map(len, polygons)))
    if sizes.min() < 3:
        odd = " ".join(polygons[int(sizes.argmin())])[:60]
        raise SceneError(f'a face "f {odd}" has fewer than 3 corners; repair the file')
    first = np.cumsum(sizes) - sizes
    polygon = np.repeat(np.arange(len(sizes)), sizes - 2)
    step = np.arange(len(polygon)) - np.repeat(np.cumsum(sizes - 2) - (sizes - 2), sizes - 2)
    start = first[polygon]
    return [corner for corners in polygons for corner in corners], np.stack(
        [start, start + step + 1, start + step + 2], axis=1
    )


def _indices(corners: list[str], counts: tuple[int, int, int]) -> Ints:
    """Parse each corner's vertex, texture coordinate and normal index, (n, 3), from 1; 0 for none."""
    slashes = {corner.count("/") for corner in corners}
    rows = np.zeros((len(corners), 3), np.int64)
    try:
        if len(slashes) == 1:
            numbers = " ".join(corners).replace("//", "/0/").replace("/", " ").split() if slashes != {0} else corners
            given = np.array(numbers, np.int64).reshape(len(corners), -1)
            rows[:, : given.shape[1]] = given
        else:
            for row, corner in zip(rows, corners):
                row[: corner.count("/") + 1] = [int(index or 0) for index in corner.split("/")]
    except (ValueError, OverflowError):
        raise SceneError("a face has a corner that is not an index; repair the file") from None
    if (rows[:, 0] == 0).any():
        raise SceneError("a face uses vertex 0, but OBJ counts from 1; repair the file")
    for kind, column, count in zip(("vertex", "texture coordinate", "normal"), rows.T, counts):
        if len(bad := column[(column < 0) | (column > count)]):
            raise SceneError(f"a face uses {kind} {bad[0]}, but the file has {count}; repair it")
    return rows


def _distinct(rows: Ints) -> tuple[Ints, Ints]:
    """Return each row's index (n,) into the distinct rows, and these, (k, 3)."""
    keys = rows[:, 0]
    for column in rows.T[1:]:
        if column.any():
            keys = np.unique(keys * (column.max() + 1) + column, return_inverse=True)[1]
    _, first, numbers = np.unique(keys, return_index=True, return_inverse=True)
    return numbers, rows[first]


def _taken(table: Floats, places: Ints) -> Floats | None:
    """Return rows of a table, zeros at −1; None if all are −1."""
    if (places < 0).all():
        return None
    return np.where(places[:, None] < 0, 0.0, table[places])


def _libraries(path: Path, text: str) -> dict[str, Material]:
    """Read the materials of an OBJ file's libraries; for a missing one, the library named like the OBJ file is read."""
    entries: dict[str, MtlMaterial] = {}
    own = path.with_suffix(".mtl")
    for line in re.findall(r"^[ \t]*mtllib[ \t]+(.*\S)", text, re.MULTILINE):
        names = [line] if (path.parent / line).is_file() else line.split()
        for library in (path.parent / name for name in names):
            if not library.is_file():
                log.warning(
                    "%s: no material library %s; %s",
                    path,
                    library.name,
                    f"using {own.name}" if own.is_file() else "its materials are plain gray",
                )
                library = own
            if library.is_file():
                try:
                    entries |= read_library(_text(library))
                except SceneError as error:
                    raise SceneError([f"{library.name}: {problem}" for problem in error.problems]) from None
    if names := left_out(entries):
        log.warning("%s: ignored: %s", path, ", ".join(names))
    maps = Maps(path)
    return {name: material(entry, maps) for name, entry in entries.items()}


def _text(path: Path) -> str:
    """Read the file as UTF-8; other bytes become surrogates, as in file names."""
    return note_read(path).read_text(encoding="utf-8", errors="surrogateescape")
