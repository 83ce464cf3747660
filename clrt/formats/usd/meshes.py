"""Shapes of a USD stage as meshes: polygons are triangulated, and split by material and at the seams of primvars."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...file_names import printable
from ...scene.geometry.normals import Normals, choose_normals
from ...scene.materials.material_types import Diffuse, Material
from ...scene.model import Mesh
from ..polygons import triangulate
from ..seams import with_corner_attributes
from ..used_indices import used_indices
from .materials import DISPLAY_COLOR, Look, Materials
from .solids import solid

log = logging.getLogger(__name__)
Array = NDArray[Any]
#: Subdivision schemes whose limit surface is smooth; their cages are shaded smoothly if they have no normals.
SMOOTH = ("catmullClark", "loop")


class Triangles(NamedTuple):
    """Triangles of a mesh: the corners (m, 3) in the list of all faces' corners, the face of each (m,), and the points
    of all corners (c,)."""

    corners: Array
    faces: Array
    points: Array


class Shapes:
    """Shapes of a stage, as stage_shapes returns them; each is made once."""

    def __init__(
        self, path: Path, arrays: dict[str, Array], facts: dict[str, Any], materials: Materials, normals: Normals
    ) -> None:
        self._path, self._arrays, self._facts, self._materials = path, arrays, facts["shapes"], materials
        self._normals = normals
        self._made: dict[int, list[Mesh]] = {}
        self._two_sided: dict[int, Material] = {}
        #: Number of meshes by what of them is not rendered.
        self.ignored: dict[str, int] = {}

    def meshes(self, number: int) -> list[Mesh]:
        """Return a shape as meshes in its own frame, one for each material."""
        if number not in self._made:
            facts = self._facts[number]
            pieces = self._polygons(number, facts) if facts["kind"] == "Mesh" else self._solid(number, facts)
            self._made[number] = list(pieces)
        return self._made[number]

    def _solid(self, number: int, facts: dict[str, Any]) -> Iterator[Mesh]:
        if (made := solid(facts["kind"], facts["size"])) is None:
            return
        vertices, faces, normals = made
        look = self._look(facts["material"])
        colors = self._constant_color(number, facts) if look is None or look.vertex_colors else None
        material = self._material(look, facts, colors)
        if material.textures():
            self._note("textures of shapes without texture coordinates")
            material = material.without_textures()
        shading = normals if self._normals == "file" else choose_normals(self._normals, vertices, faces, None)
        yield Mesh(
            vertices, faces, material, shading, printable(facts["name"]), material_name=look.name if look else ""
        )

    def _polygons(self, number: int, facts: dict[str, Any]) -> Iterator[Mesh]:
        points, name = self._arrays[f"points {number}"].reshape(-1, 3), printable(facts["name"])
        triangles = self._triangles(number, points, name, facts["left_handed"])
        if facts["subdivision"] != "none":
            self._note("subdivision of meshes, which are rendered as their control cage")
        for rows, material in self._parts(number, facts, triangles):
            part = Triangles(triangles.corners[rows], triangles.faces[rows], triangles.points)
            if len(rows):
                yield self._piece(number, facts, points, part, material)

    def _triangles(self, number: int, points: Array, name: str, left_handed: bool) -> Triangles:
        """Return a mesh's triangles. Raises SceneError for counts and indices that do not fit."""
        counts, indices = self._arrays[f"counts {number}"].astype(np.int64), self._arrays[f"indices {number}"]
        if (counts < 0).any() or counts.sum() != len(indices):
            raise SceneError(f'mesh "{name}": its faces have {counts.sum()} corners, but it has {len(indices)} indices')
        wrong = (indices < 0) | (indices >= len(points))
        if wrong.any():
            raise SceneError(
                f'mesh "{name}": a face uses point {indices[wrong.argmax()]}, but it has {len(points)}; export it again'
            )
        shown = counts >= 3
        holes = self._arrays[f"holes {number}"]
        shown[holes[(holes >= 0) & (holes < len(shown))]] = False
        if few := int(((counts < 3) & (counts > 0)).sum()):
            self._note("faces with fewer than 3 points", few)
        of_shown = np.flatnonzero(np.repeat(shown, counts))
        sizes = counts[shown]
        corners = of_shown[triangulate(points.astype(np.float64), indices[of_shown], sizes)]
        faces = np.repeat(np.flatnonzero(shown), sizes - 2)
        return Triangles(corners[:, ::-1] if left_handed else corners, faces, indices)

    def _parts(self, number: int, facts: dict[str, Any], triangles: Triangles) -> Iterator[tuple[Array, int | None]]:
        """Yield triangles, indices (k,), and their material, of subsets or of the mesh itself."""
        owner = np.full(len(self._arrays[f"counts {number}"]), -1)
        for j in range(len(facts["subsets"])):
            faces = self._arrays[f"subset {number} {j}"]
            owner[faces[(faces >= 0) & (faces < len(owner))]] = j
        of_triangle = owner[triangles.faces]
        yield np.flatnonzero(of_triangle < 0), facts["material"]
        for j, subset in enumerate(facts["subsets"]):
            own = subset["material"]
            yield np.flatnonzero(of_triangle == j), facts["material"] if own is None else own

    def _piece(
        self, number: int, facts: dict[str, Any], points: Array, triangles: Triangles, bound: int | None
    ) -> Mesh:
        look = self._look(bound)
        of_corners: dict[str, Array] = {}
        colors = None
        if look is None or look.vertex_colors:
            colors = self._constant_color(number, facts)
            if colors is None and (found := self._colors(number, facts, triangles)) is not None:
                of_corners["colors"] = found
        for key, primvar in zip(("uv", "uv1"), look.uv if look else ()):
            if (values := self._values(number, facts, primvar, triangles, 2)) is not None:
                of_corners[key] = np.column_stack([values[:, 0], 1 - values[:, 1]])
        if (normals := self._values(number, facts, "normals", triangles, 3)) is not None:
            of_corners["normals"] = normals
        used, faces = used_indices(triangles.points[triangles.corners].ravel())
        whole = {"vertices": points[used], "faces": faces.reshape(-1, 3)}
        split = with_corner_attributes(whole, of_corners)
        material = self._material(look, facts, colors, "colors" in of_corners)
        material = self._with_coordinates(material, of_corners, facts)
        mesh = Mesh(
            split["vertices"],
            split["faces"],
            material,
            name=printable(facts["name"]),
            uv=split.get("uv"),
            uv1=split.get("uv1"),
            colors=split.get("colors"),
            material_name=look.name if look else "",
        )
        smooth = self._normals == "file" and facts["subdivision"] in SMOOTH and "normals" not in split
        wanted: Normals = "smooth" if smooth else self._normals
        mesh.normals = choose_normals(wanted, mesh.vertices, mesh.faces, split.get("normals"))
        return mesh

    def _look(self, number: int | None) -> Look | None:
        return None if number is None else self._materials.look(number)

    def _material(
        self, look: Look | None, facts: dict[str, Any], color: Array | None, varies: bool = False
    ) -> Material:
        """Return the material of a shape, the same object for shapes that share it. color: a constant display color and
        opacity, (4,); varies: whether the vertices have colors."""
        white = (1.0, 1.0, 1.0)
        if look is None:
            plain = replace(Diffuse(color=white) if varies else Diffuse(), double_sided=facts["double_sided"])
            return plain if color is None else replace(plain, color=tuple(color[:3].tolist()), opacity=float(color[3]))
        material: Material = look.material
        if color is not None:
            return replace(look.material, color=tuple(color[:3].tolist()), double_sided=facts["double_sided"])
        if facts["double_sided"]:
            key = id(material)
            self._two_sided.setdefault(key, replace(material, double_sided=True))
            return self._two_sided[key]
        return material

    def _with_coordinates(self, material: Material, given: dict[str, Array], facts: dict[str, Any]) -> Material:
        """Return the material without its textures if the mesh lacks their coordinates."""
        missing = {("uv", "uv1")[texture.uv_set] for texture in material.textures()} - set(given)
        if missing:
            self._note("textures of meshes without their texture coordinates")
            return material.without_textures()
        return material

    def _primvar(self, number: int, facts: dict[str, Any], name: str) -> tuple[Array, str] | None:
        for j, (own, interpolation) in enumerate(facts["primvars"]):
            if own == name:
                return self._arrays[f"primvar {number} {j}"], interpolation
        return None

    def _values(self, number: int, facts: dict[str, Any], name: str, triangles: Triangles, width: int) -> Array | None:
        """Return the values of a primvar at the triangles' corners, (3m, width); None if it has none that fit."""
        found = self._primvar(number, facts, name)
        if found is None:
            return None
        values, interpolation = found
        if interpolation == "constant":
            rows = np.zeros(triangles.corners.size, np.int64)
        elif interpolation == "uniform":
            rows = np.repeat(triangles.faces, 3)
        else:
            rows = triangles.corners.ravel()
            rows = rows if interpolation == "faceVarying" else triangles.points[rows]
        if values.shape[1] < width or (len(rows) and rows.max() >= len(values)):
            self._note(f"primvars {name} of the wrong size")
            return None
        picked = values[rows, :width]
        return picked if name == "normals" else np.nan_to_num(picked, posinf=0, neginf=0)

    def _colors(self, number: int, facts: dict[str, Any], triangles: Triangles) -> Array | None:
        """Return display colors and opacities that vary, (3m, 3) or (3m, 4)."""
        colors = self._values(number, facts, DISPLAY_COLOR, triangles, 3)
        if colors is None:
            return None
        opacity = self._values(number, facts, "displayOpacity", triangles, 1)
        both = colors if opacity is None or (opacity >= 1).all() else np.column_stack([colors, opacity])
        return both.clip(0, 1)

    def _constant_color(self, number: int, facts: dict[str, Any]) -> Array | None:
        """Return a display color and opacity that are the same all over, (4,)."""
        color = self._primvar(number, facts, DISPLAY_COLOR)
        if color is None or color[0].shape[1] < 3 or (color[1] != "constant" and facts["kind"] == "Mesh"):
            return None
        opacity = self._primvar(number, facts, "displayOpacity")
        if opacity is not None and opacity[1] != "constant" and facts["kind"] == "Mesh":
            return None
        alpha = 1.0 if opacity is None else opacity[0][0, 0]
        return np.asarray(np.nan_to_num(np.append(color[0][0, :3], alpha)).clip(0, 1))

    def _note(self, what: str, count: int = 1) -> None:
        self.ignored[what] = self.ignored.get(what, 0) + count
