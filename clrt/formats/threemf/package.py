"""Content of a 3MF file as arrays, read by lib3mf in the decoder process.

Arrays: of mesh number i "vertices i" (n, 3), "triangles i" (m, 3), "properties i" (m, 4), a group and a property in it
for each corner; of group number g "group g", see `_Groups`; "texture t", the bytes of an image; "numbers" (k,)
and "matrices" (k, 4, 4), placed meshes. Facts: `unit`, and a `factor` to it; `meshes`, `groups` and `textures`, a dict
for each; `ignored`, counts by what it is.
"""

from __future__ import annotations

import ctypes
import struct
from collections import Counter
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Found = tuple[dict[str, NDArray[Any]], dict[str, Any]]
#: Numbers of meshes (k,), and their matrices (k, 4, 4).
Placed = tuple[NDArray[np.int64], NDArray[np.float64]]
NOTHING: Placed = (np.zeros(0, np.int64), np.zeros((0, 4, 4)))

#: Units of the specification (3MF core, 3.4), in lib3mf's order, as one of clrt's and a factor.
UNITS = (("mm", 0.001), ("mm", 1.0), ("cm", 1.0), ("in", 1.0), ("ft", 1.0), ("m", 1.0))
#: Wrap modes in lib3mf's order; "none", which is transparent outside of the image, is approximated.
WRAPS = ("repeat", "mirror", "clamp", "clamp")
NEAREST = 2
#: Maximum number of placed meshes, since components may refer to each other, and their maximum depth.
MOST_PLACES = 1 << 20
MOST_DEPTH = 64


def decode(file: str) -> Found:
    """Read a file. Raises lib3mf's exceptions, and ValueError for too many components."""
    import lib3mf

    wrapper = lib3mf.get_wrapper()
    model = wrapper.CreateModel()
    reader = model.QueryReader("3mf")
    reader.ReadFromFile(file)
    ignored = Counter[str]({"faults that lib3mf repaired": reader.GetWarningCount()})
    arrays, meshes, numbers = dict[str, NDArray[Any]](), list[dict[str, Any]](), dict[int, int]()
    groups = _Groups(model, arrays)
    objects = _every(model.GetMeshObjects(), "GetCurrentMeshObject")
    for mesh in objects:
        number = numbers[mesh.GetUniqueResourceID()] = len(meshes)
        meshes.append(_mesh(mesh, number, arrays, groups))
        ignored["beams"] += mesh.BeamLattice().GetBeamCount()
        ignored["balls"] += mesh.BeamLattice().GetBallCount()
        ignored["slice stacks"] += bool(mesh.HasSlices(False))
        ignored["volume data"] += _has_volume(mesh)
    ignored["implicit objects"] += model.GetLevelSets().Count()
    placing = _Objects(numbers, ignored)
    items = _every(model.GetBuildItems(), "GetCurrent")
    arrays["numbers"], arrays["matrices"] = joined(
        moved(placing.placed(item.GetObjectResource()), _matrix(item.GetObjectTransform())) for item in items
    )
    unit, factor = UNITS[int(model.GetUnit())]
    return arrays, {
        "unit": unit,
        "factor": factor,
        "meshes": meshes,
        "groups": groups.facts,
        "textures": groups.textures,
        "ignored": {what: count for what, count in ignored.items() if count},
    }


def _every(iterator: Any, getter: str) -> list[Any]:
    """Return what an iterator of lib3mf iterates over."""
    found = []
    while iterator.MoveNext():
        found.append(getattr(iterator, getter)())
    return found


def _read(owner: Any, function: str, kind: Any, most: int, *keys: int) -> NDArray[Any]:
    """Return the bytes, a row for each element, that a function of lib3mf writes into a buffer of at most `most`
    elements.

    Its own Python interface makes an object of each element, and fails for some functions.
    """
    if not most:
        return np.zeros((0, ctypes.sizeof(kind)), np.uint8)
    buffer, count = (kind * most)(), ctypes.c_uint64(0)
    call = getattr(owner._wrapper.lib, f"lib3mf_{function}")
    arguments = [*map(ctypes.c_uint32, keys), ctypes.c_uint64(most), count, buffer]
    owner._wrapper.checkError(owner, call(owner._handle, *arguments))
    return np.frombuffer(buffer, np.uint8).reshape(most, -1)[: count.value]


def _mesh(mesh: Any, number: int, arrays: dict[str, NDArray[Any]], groups: _Groups) -> dict[str, Any]:
    """Store the arrays of a mesh, and return its facts."""
    import lib3mf

    points, triangles = mesh.GetVertexCount(), mesh.GetTriangleCount()
    arrays[f"vertices {number}"] = _read(mesh, "meshobject_getvertices", lib3mf.Position, points).view("<f4")
    arrays[f"triangles {number}"] = _read(mesh, "meshobject_gettriangleindices", lib3mf.Triangle, triangles).view("<u4")
    used = _read(mesh, "meshobject_getalltriangleproperties", lib3mf.TriangleProperties, triangles).view("<u4")
    group, entry, given = mesh.GetObjectLevelProperty()
    if given:
        used = np.where(used[:, :1] == 0, np.array([group, entry, entry, entry], np.uint32), used)
    for resource in np.unique(used[:, 0]).tolist():
        groups.add(resource)
    arrays[f"properties {number}"] = used
    return {"name": mesh.GetName(), "id": mesh.GetResourceID()}


def _has_volume(mesh: Any) -> bool:
    import lib3mf

    try:
        return mesh.GetVolumeData() is not None
    except lib3mf.ELib3MFException:  # as it is raised for a mesh without
        return False


class _Objects:
    """Objects as the meshes that they consist of; each is expanded once, however often components refer to it."""

    def __init__(self, numbers: dict[int, int], ignored: Counter[str]) -> None:
        self._numbers, self._ignored = numbers, ignored
        self._known: dict[int, Placed] = {}

    def placed(self, shown: Any, depth: int = 0) -> Placed:
        """Return an object's meshes. Raises ValueError for too many."""
        import lib3mf

        key = shown.GetUniqueResourceID()
        if key in self._known:
            return self._known[key]
        if depth > MOST_DEPTH:
            raise ValueError(f"its components are nested more than {MOST_DEPTH} deep")
        found = NOTHING
        if int(shown.GetType()) in (lib3mf.ObjectType.Support, lib3mf.ObjectType.SolidSupport):
            self._ignored["supports"] += 1
        elif shown.IsComponentsObject():
            parts = [shown.GetComponent(i) for i in range(shown.GetComponentCount())]
            found = joined(
                moved(self.placed(part.GetObjectResource(), depth + 1), _matrix(part.GetTransform())) for part in parts
            )
        elif shown.IsMeshObject():
            found = np.array([self._numbers[key]]), np.eye(4)[None]
        return self._known.setdefault(key, found)


def moved(placed: Placed, matrix: NDArray[np.float64]) -> Placed:
    """Return the meshes under a further transform."""
    return placed[0], matrix @ placed[1]


def joined(parts: Iterable[Placed]) -> Placed:
    """Return the meshes of all parts. Raises ValueError for more than MOST_PLACES."""
    numbers, matrices = [NOTHING[0]], [NOTHING[1]]
    for part in parts:
        numbers.append(part[0])
        matrices.append(part[1])
        if sum(map(len, numbers)) > MOST_PLACES:
            raise ValueError(f"its components make more than {MOST_PLACES} meshes")
    return np.concatenate(numbers), np.concatenate(matrices)


def _matrix(transform: Any) -> NDArray[np.float64]:
    """Return a transform, which acts on row vectors, as a matrix (4, 4) that acts on column vectors."""
    matrix = np.eye(4)
    matrix[:3] = np.array([list(row) for row in transform.Fields], np.float64).T
    return matrix


class _Groups:
    """Groups of properties that meshes use. `facts` by the group's number as text: its `kind`, and

    - "material", `names`, and "color": rows of a property and its color, (k, 5), encoded, up to 255. Composites, which
      mix materials, are colors.
    - "texture", the number of its `texture`: rows of a property and its u and v, (k, 3), v upwards.
    - "multi", its `layers`, a pair each of another group's number and whether it multiplies those below: rows of a
      property and the properties in each layer, (k, 1 + layers).
    """

    def __init__(self, model: Any, arrays: dict[str, NDArray[Any]]) -> None:
        self._model, self._arrays = model, arrays
        self.facts: dict[str, dict[str, Any]] = {}
        self.textures: list[dict[str, Any]] = []
        self._numbers: dict[int, int] = {}

    def add(self, resource: int) -> None:
        """Read a group, unless it has been read or is none."""
        import lib3mf

        if not resource or str(resource) in self.facts:
            return
        kinds = {
            lib3mf.PropertyType.BaseMaterial: self._materials,
            lib3mf.PropertyType.Colors: self._colors,
            lib3mf.PropertyType.TexCoord: self._coordinates,
            lib3mf.PropertyType.Composite: self._composites,
            lib3mf.PropertyType.Multi: self._layers,
        }
        read = kinds.get(self._model.GetPropertyTypeByID(resource))
        if read is None:
            return
        facts, rows = read(resource)
        self.facts[str(resource)] = facts
        self._arrays[f"group {resource}"] = np.array(rows, np.float64).reshape(len(rows), -1)

    def _materials(self, resource: int) -> tuple[dict[str, Any], list[list[float]]]:
        group = self._model.GetBaseMaterialGroupByID(resource)
        entries = group.GetAllPropertyIDs()
        return {"kind": "material", "names": {str(entry): group.GetName(entry) for entry in entries}}, [
            [entry, *_rgba(group.GetDisplayColor(entry))] for entry in entries
        ]

    def _colors(self, resource: int) -> tuple[dict[str, Any], list[list[float]]]:
        group = self._model.GetColorGroupByID(resource)
        return {"kind": "color"}, [[entry, *_rgba(group.GetColor(entry))] for entry in group.GetAllPropertyIDs()]

    def _coordinates(self, resource: int) -> tuple[dict[str, Any], list[list[float]]]:
        group = self._model.GetTexture2DGroupByID(resource)
        points = [(entry, group.GetTex2Coord(entry)) for entry in group.GetAllPropertyIDs()]
        return {"kind": "texture", "texture": self._texture(group.GetTexture2D())}, [
            [entry, point.U, point.V] for entry, point in points
        ]

    def _composites(self, resource: int) -> tuple[dict[str, Any], list[list[float]]]:
        import lib3mf

        group = self._model.GetCompositeMaterialsByID(resource)
        base = group.GetBaseMaterialGroup()
        colors = {entry: np.array(_rgba(base.GetDisplayColor(entry))) for entry in base.GetAllPropertyIDs()}
        part, rows = lib3mf.CompositeConstituent, []
        for entry in group.GetAllPropertyIDs():
            given = _read(group, "compositematerials_getcomposite", part, len(colors), entry).tobytes()
            parts = [(each, max(share, 0.0)) for each, share in struct.iter_unpack("<Id", given)]
            total = sum(share for _, share in parts) or 1.0
            mixed = sum((colors[each] * (share / total) for each, share in parts if each in colors), np.zeros(4))
            rows.append([entry, *mixed])
        return {"kind": "color"}, rows

    def _layers(self, resource: int) -> tuple[dict[str, Any], list[list[float]]]:
        import lib3mf

        group = self._model.GetMultiPropertyGroupByID(resource)
        layers = [group.GetLayer(i) for i in range(group.GetLayerCount())]
        entries = [
            [
                entry,
                *_read(group, "multipropertygroup_getmultiproperty", ctypes.c_uint32, len(layers), entry).view("<u4")[
                    :, 0
                ],
            ]
            for entry in group.GetAllPropertyIDs()
        ]
        for layer in layers:
            if self._model.GetPropertyTypeByID(layer.ResourceID) != lib3mf.PropertyType.Multi:
                self.add(layer.ResourceID)
        multiplies = [int(layer.TheBlendMethod) == lib3mf.BlendMethod.Multiply for layer in layers]
        return {"kind": "multi", "layers": [[each.ResourceID, times] for each, times in zip(layers, multiplies)]}, [
            (row + [0] * len(layers))[: len(layers) + 1] for row in entries
        ]

    def _texture(self, texture: Any) -> int:
        """Store the bytes of a texture's image, once, and return its number."""
        resource = texture.GetUniqueResourceID()
        if resource not in self._numbers:
            number = self._numbers[resource] = len(self.textures)
            image = texture.GetAttachment()
            size = image.GetStreamSize()
            self._arrays[f"texture {number}"] = _read(image, "attachment_writetobuffer", ctypes.c_uint8, size)
            self.textures.append(
                {
                    "name": image.GetPath(),
                    "wrap": [WRAPS[int(style)] for style in texture.GetTileStyleUV()],
                    "filter": "nearest" if int(texture.GetFilter()) == NEAREST else "linear",
                }
            )
        return self._numbers[resource]


def _rgba(color: Any) -> list[float]:
    return [float(color.Red), float(color.Green), float(color.Blue), float(color.Alpha)]
