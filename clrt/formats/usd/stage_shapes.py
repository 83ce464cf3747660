"""Meshes and other shapes of a USD stage, in the decoder process."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .stage_materials import Materials

Array = NDArray[Any]
#: Shapes without points, and their attributes.
SOLIDS = {
    "Cube": ("size",),
    "Sphere": ("radius",),
    "Cylinder": ("radius", "height", "axis"),
    "Cone": ("radius", "height", "axis"),
    "Capsule": ("radius", "height", "axis"),
    "Plane": ("width", "length", "axis"),
}
#: Components of primvars that are read: texture coordinates, colors, opacities and normals.
MOST_COMPONENTS = 4
#: Values per primvar, which indices may repeat.
MOST_VALUES = 1 << 28


class Shapes:
    """Shapes, of instances once. `facts`: `kind`, "Mesh" or one of SOLIDS, `name`, `material` or None, `double_sided`,
    `primvars`, a name and interpolation each; of a mesh `left_handed`, `subdivision`, `subsets`, a material each."""

    def __init__(self, code: Any, arrays: dict[str, Array], materials: Materials, ignored: Counter[str]) -> None:
        self._code, self._arrays, self._materials, self._ignored = code, arrays, materials, ignored
        self._numbers: dict[tuple[str, int | None], int] = {}
        self.facts: list[dict[str, Any]] = []

    def number(self, prim: Any) -> int | None:
        """Return the number of a shape; None if it cannot be rendered."""
        from pxr import UsdGeom

        kind = str(prim.GetTypeName())
        if not prim.IsA(UsdGeom.Mesh) and kind not in SOLIDS:
            self._ignored[f"prims of type {kind}"] += 1
            return None
        source = prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim
        material = self._materials.bound_to(prim)
        key = str(source.GetPath()), material
        if key not in self._numbers:
            number = self._numbers[key] = len(self.facts)
            shape: dict[str, Any] = {
                "name": str(prim.GetName()),
                "material": material,
                "double_sided": bool(UsdGeom.Gprim(prim).GetDoubleSidedAttr().Get(self._code)),
                "primvars": self._primvars(prim, number),
            }
            if prim.IsA(UsdGeom.Mesh):
                shape |= self._mesh(UsdGeom.Mesh(prim), number)
            else:
                values = {name: prim.GetAttribute(name).Get(self._code) for name in SOLIDS[kind]}
                shape |= {"kind": kind, "size": values}
            self.facts.append(shape)
        return self._numbers[key]

    def _mesh(self, mesh: Any, number: int) -> dict[str, Any]:
        """Store the arrays of a mesh and return its facts."""
        from pxr import UsdGeom

        for name, attribute, dtype in (
            ("points", mesh.GetPointsAttr(), np.float32),
            ("counts", mesh.GetFaceVertexCountsAttr(), np.int32),
            ("indices", mesh.GetFaceVertexIndicesAttr(), np.int32),
            ("holes", mesh.GetHoleIndicesAttr(), np.int32),
        ):
            values = attribute.Get(self._code)
            self._arrays[f"{name} {number}"] = np.array(() if values is None else values, dtype)
        subsets = UsdGeom.Subset.GetGeomSubsets(mesh, UsdGeom.Tokens.face, "materialBind")
        for j, subset in enumerate(subsets):
            faces = subset.GetIndicesAttr().Get(self._code)
            self._arrays[f"subset {number} {j}"] = np.array(() if faces is None else faces, np.int32)
        return {
            "kind": "Mesh",
            "left_handed": str(mesh.GetOrientationAttr().Get(self._code)) == "leftHanded",
            "subdivision": str(mesh.GetSubdivisionSchemeAttr().Get(self._code)),
            "subsets": [
                {"name": str(each.GetPrim().GetName()), "material": self._materials.bound_to(each.GetPrim())}
                for each in subsets
            ],
        }

    def _primvars(self, prim: Any, number: int) -> list[tuple[str, str]]:
        """Store the primvars of numbers, and a mesh's normals, and return their names and interpolations."""
        from pxr import UsdGeom

        found: list[tuple[str, str]] = []
        for primvar in UsdGeom.PrimvarsAPI(prim).FindPrimvarsWithInheritance():
            values = primvar.ComputeFlattened(self._code)
            self._store(found, number, str(primvar.GetPrimvarName()), str(primvar.GetInterpolation()), values)
        mesh = UsdGeom.PointBased(prim)
        if mesh and "normals" not in [name for name, _ in found]:
            values = mesh.GetNormalsAttr().Get(self._code)
            self._store(found, number, "normals", str(mesh.GetNormalsInterpolation()), values)
        return found

    def _store(self, found: list[tuple[str, str]], number: int, name: str, interpolation: str, values: Any) -> None:
        try:
            array = np.atleast_1d(np.array(values, np.float32))
        except (ValueError, TypeError):  # text, matrices
            return
        if values is None or not array.size or array.ndim > 2 or array.size > MOST_VALUES:
            return
        rows = array.reshape(len(array), -1) if interpolation != "constant" or array.ndim == 2 else array.reshape(1, -1)
        if rows.shape[1] > MOST_COMPONENTS and name != "displayOpacity":
            return
        self._arrays[f"primvar {number} {len(found)}"] = rows
        found.append((name, interpolation))
