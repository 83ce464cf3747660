"""Paths recorded for training: the vertices at which a direction was sampled from BSDF or guiding field."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...device.programs.preamble import defines, typedefs
from ...device.programs.struct_types import record
from ..accumulation.local import LocalAccumulation
from ..accumulation.per_pixel_kernel import per_pixel_kernel, render_pixels

#: Maximum number of vertices of a path that are recorded: light seldom takes longer paths to the camera.
MOST_VERTICES = 12
#: The words of a vertex (kernels/guiding/record.cl): float32 but for the direction.
_ROW = np.dtype(
    [
        ("position", "3f4"),
        ("direction", "u4"),
        ("so_far", "f4"),
        ("throughput", "f4"),
        ("pdf", "f4"),
        ("bsdf_pdf", "f4"),
        ("weight", "f4"),
        ("normal", "3f4"),
    ]
)
#: place: position and normal; direction: as a point of the unit square in 16-bit fixed point; direct: luminance along
#: it that the next vertex emits or reflects from lights, or that of the environment; weight: luminance of the sample's
#: weight; pdf, bsdf_pdf: the density that the direction was sampled with, and that of the BSDF alone; goes: whether the
#: path goes on from here; ends: whether this is its last vertex.
VERTEX = np.dtype(
    [
        ("place", "6f4"),
        ("direction", "u4"),
        ("direct", "f4"),
        ("weight", "f4"),
        ("pdf", "f4"),
        ("bsdf_pdf", "f4"),
        ("goes", "?"),
        ("ends", "?"),
    ]
)


def record_paths(session: LocalAccumulation, sample: int) -> NDArray[Any]:
    """Return the VERTEX records of a path through each pixel, path by path. sample: the number of the path."""
    count = max(1, min(int(session.launch["max_depth"][0]) - 1, MOST_VERTICES))
    words = _ROW.itemsize // 4
    kind = record(light="f4", count="i4", pad="2i4", vertices=f"({count},{words})f4")
    preamble = [
        "#define TRAINING 1",
        defines({"VERTICES": count}),
        typedefs({"PathRecord": kind}),
    ]
    kernel = per_pixel_kernel(
        session,
        "record_paths",
        "record_paths",
        lambda: (session.compiled.source_of("guiding/record.cl", *preamble), kind),
    )
    paths = render_pixels(session, kernel, 1, sample).ravel()
    path, number = np.nonzero(np.arange(count) < paths["count"][:, None])
    return _vertices(
        paths["vertices"].view(_ROW)[path, number, 0], number + 1 == paths["count"][path], paths["light"][path]
    )


def _vertices(rows: NDArray[Any], ends: NDArray[np.bool_], light: NDArray[np.float32]) -> NDArray[Any]:
    """Return the records of rows. ends: whether they are the last of their paths; light: that of their whole paths."""
    found = np.empty(len(rows), VERTEX)
    found["place"][:, :3], found["place"][:, 3:] = rows["position"], rows["normal"]
    for name in ("direction", "pdf", "bsdf_pdf"):
        found[name] = rows[name]
    found["goes"], found["ends"] = rows["throughput"] > 0, ends
    added = np.where(ends, light, np.roll(rows["so_far"], -1)) - rows["so_far"]
    with np.errstate(over="ignore"):
        direct = np.divide(added, rows["throughput"], out=np.zeros_like(added), where=found["goes"] & (added > 0))
    found["direct"], found["weight"] = (np.where(np.isfinite(each), each, 0) for each in (direct, rows["weight"]))
    return found
