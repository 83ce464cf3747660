"""Validation of a mesh's arrays."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..fields.field_types import show
from ..fields.valid_arrays import faults_once

FloatArray = NDArray[np.float32]
#: Per-vertex arrays that a mesh may have, and their numbers of components.
CORNERS = {"normals": (3,), "uv": (2,), "uv1": (2,), "colors": (3, 4), "tangents": (4,)}


def mesh_faults(vertices: object, faces: object, corners: Mapping[str, object]) -> list[str]:
    """Return what is wrong with a mesh's arrays: "ARRAY[i] = value is wrong; remedy".

    corners: those of CORNERS that it has. Rejected: other shapes or dtypes than those of `Mesh`, no triangles, values
    that are not finite (used by a face or not), indices out of range, normals of length zero, and colors outside 0 to
    1.
    """
    n = len(vertices) if isinstance(vertices, np.ndarray) and vertices.ndim else 0
    if faults := _form_faults(vertices, faces, corners, n):
        return faults
    assert isinstance(vertices, np.ndarray) and isinstance(faces, np.ndarray)
    if len(faces) == 0:
        faults.append("has no triangles; add some or leave the mesh out")
    faults += faults_once(faces, ("faces", n), partial(_index_faults, faces, n))
    faults += faults_once(vertices, "vertices", partial(_row_faults, "vertices", vertices))
    for name, array in corners.items():
        assert isinstance(array, np.ndarray)
        faults += faults_once(array, name, partial(_row_faults, name, array))
    return faults


def index_problems(faces: NDArray[np.integer], n: int, where: str) -> list[str]:
    """Return the first index, of any integer dtype, outside 0 … n − 1, and the number of others."""
    return [f"{where}: {fault}" for fault in _index_faults(faces, n)]


def _index_faults(faces: NDArray[np.integer], n: int) -> list[str]:
    if len(faces) == 0 or (faces.min() >= 0 and faces.max() < n):
        return []
    bad = np.asarray(((faces < 0) | (faces >= n)).any(axis=1))
    face = int(bad.argmax())
    vertex = next(index for index in faces[face].tolist() if not 0 <= index < n)
    valid = f"valid indices are 0 to {n - 1}" if n else "the mesh has no vertices"
    return [f"faces[{face}] uses vertex {vertex}, but {valid}{_others(bad)}; repair the mesh"]


def _form_faults(vertices: object, faces: object, corners: Mapping[str, object], n: int) -> list[str]:
    """Return faults of the arrays' types and shapes; of wide indices those that are out of range."""
    arrays: list[tuple[str, object, type, str, tuple[int, ...]]] = [
        ("vertices", vertices, np.float32, "n", (3,)),
        ("faces", faces, np.int32, "m", (3,)),
        *((name, array, np.float32, str(n), CORNERS[name]) for name, array in corners.items()),
    ]
    faults = [fault for array in arrays if (fault := _array_fault(*array))]
    if faults and isinstance(faces, np.ndarray) and faces.dtype in (np.int64, np.uint64, np.uint32) and faces.ndim == 2:
        return _index_faults(faces, n) or faults
    return faults


def _array_fault(name: str, array: object, dtype: type, rows: str, columns: tuple[int, ...]) -> str | None:
    """Return a fault unless `array` is a (rows, k) array of `dtype`, with k one of `columns`."""
    kind, shape = np.dtype(dtype).name, " or ".join(f"({rows}, {k})" for k in columns)
    if not isinstance(array, np.ndarray):
        return f"{name}: {show(array)} is not an array of numbers; write one of {kind}, shape {shape}"
    if array.dtype != dtype:
        remedy = (
            "write integers" if dtype is np.int32 and array.dtype.kind != "i" else f"convert it with .astype(np.{kind})"
        )
        return f"{name} has dtype {array.dtype}; {remedy}"
    if array.ndim != 2 or array.shape[1] not in columns or (rows.isdigit() and len(array) != int(rows)):
        return f"{name} has shape {array.shape}; it must be {shape}"
    return None


def _row_faults(name: str, array: FloatArray) -> list[str]:
    """Return a fault for the first bad row, with the number of others."""
    bad, fault = _not_finite(array), "is not finite"
    if name == "normals":
        bad, fault = bad | ~np.any(array, axis=1), "points nowhere"
    elif name == "colors":
        bad, fault = bad | np.any((array < 0) | (array > 1), axis=1), "is not a colour from 0 to 1"
    if not bad.any():
        return []
    row = int(bad.argmax())
    value = show(tuple(float(f"{each:.6g}") for each in array[row]))
    return [f"{name}[{row}] = {value} {fault}{_others(bad)}; repair the mesh"]


def _not_finite(rows: FloatArray) -> NDArray[np.bool_]:
    finite = np.ones(len(rows), np.bool_)
    for column in np.isfinite(rows).T:  # all(axis=1) takes seven times as long
        finite &= column
    return ~finite


def _others(rows: NDArray[np.bool_]) -> str:
    count = int(rows.sum()) - 1
    return f" (and {count} more)" if count else ""
