"""Packing of materials: an array of records for each type in use."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....scene.materials.layer_energy import ENTRY, Table
from ....scene.materials.material import factor_of, texture_roles
from ....scene.materials.material_types import MATERIALS, Material
from ....scene.materials.textures import Texture
from ....scene.render_settings import Culling
from ..records import LAYER_PARTS, TextureNumber, parameter_record, texture_field
from .pack_textures import PackedTextures

Number = float | tuple[float, ...] | int


@dataclass(frozen=True)
class PackedMaterials:
    """Packed materials. codes: (users,) int32, each user's type | index << 4. buffers: records of each type, by kernel.
    reads: by `kernel_parameter`, whether some material of the type reads it from a texture. features: those of each
    type."""

    codes: NDArray[np.int32]
    buffers: dict[str, tuple[str, NDArray[Any]]]
    reads: dict[str, bool]
    used: list[type[Material]]
    features: dict[type[Material], frozenset[str]]

    def featured(self, feature: str) -> list[type[Material]]:
        """Return the types in use of which some material has the feature."""
        return [kind for kind in self.used if feature in self.features[kind]]

    def with_value(self, parameter: str) -> list[type[Material]]:
        """Return the types in use that have the parameter."""
        return [kind for kind in self.used if f"{kind.kernel}_{parameter}" in self.reads]

    def mapped(self, parameter: str) -> list[type[Material]]:
        """Return the types in use that read the parameter from a texture."""
        return [kind for kind in self.used if self.reads.get(f"{kind.kernel}_{parameter}")]

    @property
    def normal_maps(self) -> bool:
        """Whether there are normal maps, on surfaces or on their coats."""
        return bool(self.mapped("normal_map") or self.mapped("clearcoat_normal_map"))

    @property
    def tangents(self) -> bool:
        """Whether materials need the tangents of surfaces."""
        return self.normal_maps or bool(self.featured("ANISOTROPY") or self.featured("BRUSH"))


class MaterialTables:
    """Tables of all materials, without duplicates."""

    def __init__(self) -> None:
        self._first: dict[Table, int] = {}
        self._entries = 0

    def first(self, table: Table) -> int:
        """Return the index of its first entry."""
        if table not in self._first:
            self._first[table] = self._entries
            self._entries += len(table) // ENTRY
        return self._first[table]

    def buffers(self) -> dict[str, tuple[str, NDArray[Any]]]:
        """Return the buffer of all entries, if there are any."""
        if not self._first:
            return {}
        entries = np.concatenate([np.array(table, np.float32) for table in self._first]).reshape(-1, ENTRY)
        return {"layer_entries": ("LayerParts", np.ascontiguousarray(entries).view(LAYER_PARTS).ravel())}


def pack_materials(
    users: Iterable[Material], textures: PackedTextures, tables: MaterialTables, culling: Culling
) -> PackedMaterials:
    """Pack the materials of these users without duplicates, adding their textures to `textures` and their tables to
    `tables`; culling: back-face culling mode."""
    distinct: dict[type[Material], dict[Material, int]] = {}
    codes = []
    for material in users:
        indices = distinct.setdefault(type(material), {})
        codes.append(MATERIALS.index(type(material)) | indices.setdefault(material, len(indices)) << 4)
    used = [kind for kind in MATERIALS if kind in distinct]
    buffers: dict[str, tuple[str, NDArray[Any]]] = {}
    reads: dict[str, bool] = {}
    for kind in used:
        values = [_values(material, textures, tables, culling) for material in distinct[kind]]
        records = np.zeros(len(values), parameter_record(values))
        names = {name for named in values for name in named}
        textured = {name for named in values for name, value in named.items() if isinstance(value, TextureNumber)}
        for name in textured:
            records[name] = -1
        for i, (material, named) in enumerate(zip(distinct[kind], values)):
            plain = material.without_textures()  # fallback values, without textures
            for name in records.dtype.names or ():
                if name in named or getattr(plain, name, None) is not None:
                    value = named.get(name, getattr(plain, name, 0))
                    if isinstance(value, tuple):
                        records[name][i, : len(value)] = value
                    else:
                        records[name][i] = value
        buffers[kind.kernel] = (kind.__name__, records)
        reads |= {f"{kind.kernel}_{name}": texture_field(name) in textured for name in sorted(names - textured)}
    features = {kind: frozenset[str]().union(*(material.features() for material in distinct[kind])) for kind in used}
    return PackedMaterials(np.array(codes, np.int32), buffers, reads, used, features)


def _values(
    material: Material, textures: PackedTextures, tables: MaterialTables, culling: Culling
) -> dict[str, Number]:
    """Return the values of its record: a texture's factor and its number, a table's first entry."""
    parameters = material.parameters()
    parameters |= material.surface_parameters(culling)
    roles = texture_roles(type(material))
    values: dict[str, Number] = {}
    for name, value in parameters.items():
        if isinstance(value, Texture):
            values[name] = factor_of(value, roles[name])
            values[texture_field(name)] = TextureNumber(textures.number(value))
        elif isinstance(value, Table):
            values[name] = float(tables.first(value))
        else:
            values[name] = value
    return values
