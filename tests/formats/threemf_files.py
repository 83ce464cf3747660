"""Writers of small 3MF files for the tests."""

from __future__ import annotations

import ctypes
import locale
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

TETRAHEDRON = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]], np.float32)
IDENTITY = np.eye(3, 4)
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


class Package:
    """3MF file under construction, through lib3mf."""

    def __init__(self) -> None:
        import lib3mf

        self.library: Any = lib3mf
        self.wrapper = lib3mf.get_wrapper()
        self.model = self.wrapper.CreateModel()

    def mesh(self, name: str = "part", points: NDArray[np.float32] = TETRAHEDRON) -> Any:
        """Add a tetrahedron."""
        mesh = self.model.AddMeshObject()
        mesh.SetName(name)
        for point in points.tolist():
            mesh.AddVertex(self.library.Position((ctypes.c_float * 3)(*point)))
        for face in FACES.tolist():
            mesh.AddTriangle(self.library.Triangle((ctypes.c_uint32 * 3)(*face)))
        return mesh

    def transform(self, matrix: NDArray[np.float64]) -> Any:
        """Return an affine matrix (3, 4) as lib3mf has it."""
        rows = [(ctypes.c_float * 3)(*row) for row in matrix.T.tolist()]
        return self.library.Transform((ctypes.c_float * 3 * 4)(*rows))

    def item(self, shown: Any, matrix: NDArray[np.float64] = IDENTITY) -> None:
        self.model.AddBuildItem(shown, self.transform(matrix))

    def properties(self, mesh: Any, triangle: int, group: Any, entries: Sequence[int]) -> None:
        """Give a triangle's corners properties of a group."""
        numbers = (ctypes.c_uint32 * 3)(*entries)
        mesh.SetObjectLevelProperty(group.GetUniqueResourceID(), entries[0])  # which the writer requires
        mesh.SetTriangleProperties(triangle, self.library.TriangleProperties(group.GetUniqueResourceID(), numbers))

    def color(self, red: int, green: int, blue: int, alpha: int = 255) -> Any:
        return self.wrapper.RGBAToColor(red, green, blue, alpha)

    def texture(self, image: Path) -> Any:
        """Add a group of texture coordinates of a PNG image."""
        attachment = self.model.AddAttachment(
            f"/3D/Textures/{image.name}", "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dtexture"
        )
        attachment.ReadFromFile(str(image))
        texture = self.model.AddTexture2DFromAttachment(attachment)
        texture.SetContentType(self.library.TextureType.PNG)
        texture.SetTileStyleUV(self.library.TextureTileStyle.Clamp, self.library.TextureTileStyle.Mirror)
        return self.model.AddTexture2DGroup(texture)

    def write(self, path: Path) -> Path:
        before = locale.setlocale(locale.LC_ALL)  # lib3mf sets that of C
        self.model.QueryWriter("3mf").WriteToFile(str(path))
        locale.setlocale(locale.LC_ALL, before)
        return path


def painted() -> Package:
    """Return a file with a mesh of two base materials, placed twice, once through a component, in inches."""
    package = Package()
    package.model.SetUnit(package.library.ModelUnit.Inch)
    mesh, group = package.mesh(), package.model.AddBaseMaterialGroup()
    red = group.AddMaterial("red", package.color(255, 0, 0))
    blue = group.AddMaterial("blue", package.color(0, 0, 255, 128))
    for triangle in range(4):
        package.properties(mesh, triangle, group, [red if triangle else blue] * 3)
    both = package.model.AddComponentsObject()
    both.AddComponent(mesh, package.transform(np.column_stack([np.eye(3), [0, 0, 10]])))
    package.item(mesh)
    package.item(both, np.column_stack([2 * np.eye(3), [5, 0, 0]]))
    return package
