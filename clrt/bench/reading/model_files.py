"""Model files of one mesh in all formats, for measurements: a grid with random heights and normals."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...formats.gltf.glb_writer import mesh_glb
from ...scene.model import Mesh

Array = NDArray[Any]
#: Rows that are formatted at a time.
PART = 1 << 16
CONTENT_TYPES = (
    '<?xml version="1.0"?><Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>'
)
RELATIONSHIPS = (
    '<?xml version="1.0"?><Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="r" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
)


class Grid(NamedTuple):
    """Mesh: vertices and normals (n, 3), uv (n, 2), faces (m, 3)."""

    vertices: Array
    normals: Array
    uv: Array
    faces: Array


def grid(triangles: int) -> Grid:
    """Return a square grid of at least this number of triangles."""
    side = int(np.ceil((triangles / 2) ** 0.5)) + 1
    rng = np.random.default_rng(0)
    u, v = (each.ravel() / (side - 1) for each in np.meshgrid(np.arange(side), np.arange(side)))
    vertices = np.stack([2 * u - 1, rng.normal(0, 0.01, side * side), 2 * v - 1], axis=1)
    normals = rng.normal(0, 0.3, (side * side, 3)) + [0, 1, 0]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    first = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    corners = [first, first + side, first + 1, first + 1, first + side, first + side + 1]
    return Grid(
        vertices.astype(np.float32),
        normals.astype(np.float32),
        np.stack([u, v], axis=1).astype(np.float32),
        np.stack(corners, axis=1).reshape(-1, 3).astype(np.int32),
    )


def _lines(form: str, *columns: Array) -> Iterator[str]:
    """Yield the text of rows in parts."""
    rows = np.concatenate([each.reshape(len(each), -1).astype(object) for each in columns], axis=1)
    for part in np.split(rows, range(PART, len(rows), PART)):
        yield form * len(part) % tuple(part.ravel())


def _text(path: Path, *parts: Iterator[str] | str) -> None:
    with path.open("w") as file:
        for part in parts:
            file.writelines([part] if isinstance(part, str) else part)


def _plain_obj(path: Path, mesh: Grid) -> None:
    _text(path, _lines("v %.6f %.6f %.6f\n", mesh.vertices), _lines("f %d %d %d\n", mesh.faces + 1))


def _obj(path: Path, mesh: Grid) -> None:
    _text(
        path,
        _lines("v %.6f %.6f %.6f\n", mesh.vertices),
        _lines("vt %.6f %.6f\n", mesh.uv),
        _lines("vn %.6f %.6f %.6f\n", mesh.normals),
        _lines("f %d/%d/%d %d/%d/%d %d/%d/%d\n", np.repeat(mesh.faces + 1, 3, axis=1)),
    )


def _ply_header(mesh: Grid, form: str) -> str:
    scalars = "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz", "s", "t"))
    return (
        f"ply\nformat {form} 1.0\nelement vertex {len(mesh.vertices)}\n{scalars}"
        f"element face {len(mesh.faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )


def _ply(path: Path, mesh: Grid) -> None:
    faces = np.zeros(len(mesh.faces), [("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, mesh.faces
    rows = np.column_stack(mesh[:3]).astype("<f4")
    path.write_bytes(_ply_header(mesh, "binary_little_endian").encode() + rows.tobytes() + faces.tobytes())


def _text_ply(path: Path, mesh: Grid) -> None:
    vertices = _lines("%.6f " * 7 + "%.6f\n", *mesh[:3])
    _text(path, _ply_header(mesh, "ascii"), vertices, _lines("3 %d %d %d\n", mesh.faces))


def _facets(mesh: Grid) -> Array:
    """Return each triangle's normal and corners, (m, 12)."""
    corners = mesh.vertices[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return np.concatenate([normals, corners.reshape(-1, 9)], axis=1)


def _stl(path: Path, mesh: Grid) -> None:
    records = np.zeros(len(mesh.faces), [("facet", "<f4", 12), ("attribute", "<u2")])
    records["facet"] = _facets(mesh)
    path.write_bytes(bytes(80) + len(records).to_bytes(4, "little") + records.tobytes())


def _text_stl(path: Path, mesh: Grid) -> None:
    point = " %.6e" * 3 + "\n"
    facet = f"facet normal{point}  outer loop\n" + f"    vertex{point}" * 3 + "  endloop\nendfacet\n"
    _text(path, "solid grid\n", _lines(facet, _facets(mesh)), "endsolid grid\n")


def _off(path: Path, mesh: Grid) -> None:
    head = f"OFF\n{len(mesh.vertices)} {len(mesh.faces)} 0\n"
    _text(path, head, _lines("%.6f %.6f %.6f\n", mesh.vertices), _lines("3 %d %d %d\n", mesh.faces))


def _glb(path: Path, mesh: Grid) -> None:
    path.write_bytes(mesh_glb(Mesh(mesh.vertices, mesh.faces, normals=mesh.normals, uv=mesh.uv)))


def _usd(path: Path, mesh: Grid) -> None:
    from pxr import Sdf, Usd, UsdGeom, Vt

    stage = Usd.Stage.CreateNew(str(path))
    made = UsdGeom.Mesh.Define(stage, "/grid")
    made.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(mesh.vertices))
    made.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(mesh.normals))
    made.SetNormalsInterpolation("vertex")
    made.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(mesh.faces), 3, np.int32)))
    made.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(mesh.faces.ravel()))
    made.CreateSubdivisionSchemeAttr("none")
    coordinates = UsdGeom.PrimvarsAPI(made).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "vertex")
    coordinates.Set(Vt.Vec2fArray.FromNumpy(mesh.uv))
    stage.SetDefaultPrim(made.GetPrim())
    stage.Save()


def _3mf(path: Path, mesh: Grid) -> None:
    parts = [
        '<?xml version="1.0"?><model unit="meter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">'
        '<resources><object id="1" type="model"><mesh><vertices>',
        *_lines('<vertex x="%.6f" y="%.6f" z="%.6f"/>\n', mesh.vertices),
        "</vertices><triangles>",
        *_lines('<triangle v1="%d" v2="%d" v3="%d"/>\n', mesh.faces),
        '</triangles></mesh></object></resources><build><item objectid="1"/></build></model>',
    ]
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("[Content_Types].xml", CONTENT_TYPES)
        archive.writestr("_rels/.rels", RELATIONSHIPS)
        archive.writestr("3D/3dmodel.model", "".join(parts))


#: Writers by file name. `corners.obj` has texture coordinates and normals, as have `.ply`, `.glb` and `.usdc`.
FILES: dict[str, Callable[[Path, Grid], None]] = {
    "corners.obj": _obj,
    "plain.obj": _plain_obj,
    "binary.ply": _ply,
    "text.ply": _text_ply,
    "binary.stl": _stl,
    "text.stl": _text_stl,
    "plain.off": _off,
    "mesh.glb": _glb,
    "mesh.usdc": _usd,
    "mesh.3mf": _3mf,
}
