"""Materials of a type are packed into one array of records, whichever fields of each are textured."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar, get_args, get_type_hints

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.numerics.bsdf_cases import variants
from clrt.errors import ObjectError
from clrt.rendering.compile.materials.pack_materials import MaterialTables, pack_materials
from clrt.rendering.compile.materials.pack_textures import PackedTextures
from clrt.scene.materials.material import TextureRole, texture_roles
from clrt.scene.materials.material_types import MATERIALS, Albedo, Material
from clrt.scene.materials.textures import WHITE, Picture, Texture

from ..covering import covering

#: Random materials per type.
COUNT = 40


def textured(kind: type[Material], rng: np.random.Generator) -> Material:
    """Return a random variant of the type with random textures on some of the fields that can be textured."""
    chosen, hints = variants(kind), get_type_hints(kind)
    while True:
        names = [field.name for field in fields(kind) if Texture in get_args(hints[field.name]) and rng.random() < 0.5]
        texels = rng.integers(0, 256, (len(names), 2, 2, 4), np.uint8)
        found: dict[str, Any] = {
            name: Texture(picture=Picture(each), factor=float(rng.uniform(0.1, 0.9)))
            for name, each in zip(names, texels)
        }
        plain = chosen[int(rng.integers(len(chosen)))]
        with suppress(ObjectError):  # fields that do not go together
            return replace(plain, **found)


@dataclass(frozen=True, kw_only=True)
class Painted(Material):
    """A material whose color is textured unless another is given, and whose fields have names like kernel fields."""

    kernel: ClassVar[str] = "painted"
    color: Albedo | Texture = Texture(picture=WHITE, factor=0.5)
    grain_texture: float = 0.25
    bumps: Texture | None = Texture(picture=WHITE)


def test_roles_of_textures_are_those_of_the_types() -> None:
    """Neither a default value nor a name changes them."""
    roles = texture_roles(Painted)
    assert (roles["color"], roles["bumps"]) == (TextureRole.COLOR, TextureRole.MAP) and "grain_texture" not in roles
    assert (roles["emission"], roles["opacity"]) == (TextureRole.COLOR, TextureRole.NUMBER)
    plain = Painted().without_textures()
    assert (plain.color, plain.bumps, plain.grain_texture) == ((0.5, 0.5, 0.5), None, 0.25)


def names_of(records: NDArray[Any]) -> set[str]:
    """Return the record's fields without its padding."""
    return {name for name in records.dtype.names or () if not name.startswith(("pad", "rest"))}


@pytest.mark.programs
@covering("kind, seed", MATERIALS, range(5))
def test_materials_are_packed_together_as_alone(kind: type[Material], seed: int) -> None:
    """A record equals that of the material packed alone, and refers to no texture that the material does not use."""
    rng = np.random.default_rng(seed)
    users = [textured(kind, rng) for _ in range(COUNT)]
    textures, tables = PackedTextures(), MaterialTables()
    together = pack_materials(users, textures, tables, "none")
    _, records = together.buffers[kind.kernel]
    for code, user in zip(together.codes, users):
        record, (_, (alone,)) = (
            records[code >> 4],
            pack_materials([user], textures, tables, "none").buffers[kind.kernel],
        )
        # Arrays are as long as the longest of the type, padded with zeros.
        assert all(
            np.array_equal(np.ravel(record[name])[: alone[name].size], np.ravel(alone[name]))
            for name in names_of(alone)
        )
        others = names_of(records) - names_of(alone)
        assert all(record[name] == -1 for name in others if name.endswith("_texture"))
