"""Leaf triangles in the precomputed forms of some intersection tests, from the corners that every builder writes.

They replace the records of `layouts`. They are computed in float64 and rounded once. A triangle without area, or an
unused lane of a pack, becomes one that no ray hits.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..device.launches.device_arrays import on_host
from ..device.open import Device
from .layouts import LANES, Layout, Records

Doubles = NDArray[np.float64]
#: Records converted at a time.
CHUNK = 1 << 16

PRECOMPUTED_TRIANGLE = np.dtype(
    [
        ("p0", "f4", 3),
        ("primitive", "i4"),
        ("e1", "f4", 3),
        ("pad1", "i4"),
        ("e2", "f4", 3),
        ("pad2", "i4"),
        ("n", "f4", 3),
        ("pad3", "i4"),
    ]
)
PRECOMPUTED_PACK = np.dtype(
    [
        ("p0", "f4", (3, LANES)),
        ("e1", "f4", (3, LANES)),
        ("e2", "f4", (3, LANES)),
        ("n", "f4", (3, LANES)),
        ("primitive", "i4", LANES),
    ]
)
#: All twelve entries of the transform, though one column is always (0, 0, 1): it differs between the triangles of a
#: pack, for which nine entries would need more selections than they save products.
BALDWIN_WEBER_TRIANGLE = np.dtype(
    [("u", "f4", 4), ("v", "f4", 4), ("w", "f4", 4), ("primitive", "i4"), ("pad", "i4", 3)]
)
BALDWIN_WEBER_PACK = np.dtype(
    [("u", "f4", (4, LANES)), ("v", "f4", (4, LANES)), ("w", "f4", (4, LANES)), ("primitive", "i4", LANES)]
)


def _precomputed(p0: Doubles, p1: Doubles, p2: Doubles) -> dict[str, Doubles]:
    """Return the edges and their cross product: Suchiński 2022, eq. 3.7."""
    e1, e2 = p1 - p0, p2 - p0
    return {"p0": p0, "e1": e1, "e2": e2, "n": _cross(e1, e2)}


def _baldwin_weber(p0: Doubles, p1: Doubles, p2: Doubles) -> dict[str, Doubles]:
    """Return the rows of Baldwin and Weber's transform (2016): p0 to the origin, e1 to u, e2 to v, and `free` to w.

    free: the axis on which the normal is largest. The rows are those of the inverse of (e1, e2, free), with a shift by
    −p0.
    """
    e1, e2 = p1 - p0, p2 - p0
    n = _cross(e1, e2)
    axis = np.arange(3).reshape(1, 3, *[1] * (n.ndim - 2))
    free = (axis == np.abs(n).argmax(axis=1, keepdims=True)).astype(np.float64)
    rows = {"u": _cross(e2, free), "v": _cross(free, e1), "w": n}
    return {name: np.concatenate([row, -_dot(row, p0)], axis=1) / _dot(n, free) for name, row in rows.items()}


class TriangleForm(NamedTuple):
    """How a test stores its triangles. leaf, pack: the records. fields: computes their contents except for `primitive`.

    fields takes p0, p1, p2 (n, 3) or, for packs, (n, 3, 8), and returns arrays (n, k) or (n, k, 8).
    """

    leaf: np.dtype[np.void]
    pack: np.dtype[np.void]
    fields: Callable[[Doubles, Doubles, Doubles], dict[str, Doubles]]


#: Forms by test; the other tests use corners.
FORMS = {
    "precomputed": TriangleForm(PRECOMPUTED_TRIANGLE, PRECOMPUTED_PACK, _precomputed),
    "baldwin_weber": TriangleForm(BALDWIN_WEBER_TRIANGLE, BALDWIN_WEBER_PACK, _baldwin_weber),
}


def in_form(tree: Layout, triangle: str, device: Device | None) -> Layout:
    """Convert the BVH's triangles from corners to the form of the test `triangle`; device: the buffers', if any."""
    if triangle not in FORMS:
        return tree
    start, form = time.perf_counter(), FORMS[triangle]
    dtypes = {"packs": form.pack, "leaf_triangles": form.leaf}
    corners = {
        name: on_host(device, tree.buffers[name]) if device else tree.buffers[name]
        for name in dtypes
        if name in tree.buffers
    }
    changed = {name: _converted(records, dtypes[name], form) for name, records in corners.items()}
    seconds = tree.build_seconds + time.perf_counter() - start
    return replace(tree, buffers={**tree.buffers, **changed}, build_seconds=seconds)


def _converted(corners: Records, dtype: np.dtype[np.void], form: TriangleForm) -> Records:
    records = np.zeros(len(corners), dtype)
    records["primitive"] = corners["primitive"]
    for first in range(0, len(corners), CHUNK):
        part = slice(first, first + CHUNK)
        with np.errstate(all="ignore"):
            p0, p1, p2 = (corners[part][name].astype(np.float64) for name in ("p0", "p1", "p2"))
            for name, values in form.fields(p0, p1, p2).items():
                records[name][part] = values
    return records


def _cross(a: Doubles, b: Doubles) -> Doubles:
    return np.asarray(np.cross(a, b, axis=1))


def _dot(a: Doubles, b: Doubles) -> Doubles:
    return np.asarray(np.sum(a * b, axis=1, keepdims=True))
