"""Materials of a USD stage, in the decoder process: UsdPreviewSurface, and what its inputs are connected to."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
#: Surface shaders with the inputs of UsdPreviewSurface, and the nodes that are known.
SURFACES = ("UsdPreviewSurface", "ND_UsdPreviewSurface_surfaceshader")
TEXTURE, TRANSFORM, READER = "UsdUVTexture", "UsdTransform2d", "UsdPrimvarReader_"
#: Nodes followed from a texture to its coordinates.
MOST_NODES = 8
#: Bytes of an image in an archive.
MOST_BYTES = 2**31


class Materials:
    """Materials that shapes are bound to. `facts`: `name`, `unknown`, the shader if it is not known, and `inputs` by
    name, each a dict of its `value`, of the `primvar` that it reads, or of its `texture`, an `output` of it, and the
    inputs of the nodes: `scale`, `bias`, `fallback`, `wrap`, `space`, `uv`, a primvar, and `transform`. `textures`: a
    dict of the `path`, and `name`, None if it was not found."""

    def __init__(self, code: Any, arrays: dict[str, Array], ignored: Counter[str]) -> None:
        self._code, self._arrays, self._ignored = code, arrays, ignored
        self._numbers: dict[str, int | None] = {}
        self._textures: dict[str, int] = {}
        self.facts: list[dict[str, Any]] = []
        self.textures: list[dict[str, Any]] = []

    def bound_to(self, prim: Any) -> int | None:
        """Return the number of a prim's material; None if it has none."""
        from pxr import UsdShade

        material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial(UsdShade.Tokens.preview)
        if not material:
            return None
        own = material.GetPrim()
        key = str((own.GetPrimInPrototype() if own.IsInstanceProxy() else own).GetPath())
        if key not in self._numbers:
            facts = self._material(material)
            self._numbers[key] = len(self.facts)
            self.facts.append(facts)
        return self._numbers[key]

    def _material(self, material: Any) -> dict[str, Any]:
        facts: dict[str, Any] = {"name": str(material.GetPrim().GetName()), "inputs": {}}
        shader = material.ComputeSurfaceSource()[0] or material.ComputeSurfaceSource("mtlx")[0]
        if not shader:
            return facts | {"unknown": "no surface shader"}
        kind = str(shader.GetIdAttr().Get())
        if kind not in SURFACES:
            return facts | {"unknown": kind}
        for given in shader.GetInputs():
            facts["inputs"][str(given.GetBaseName())] = self._input(given)
        return facts

    def _input(self, given: Any) -> dict[str, Any]:
        """Return what an input of the surface is set or connected to."""
        from pxr import UsdShade

        source = self._source(given)
        if source is None:
            return {}
        if not UsdShade.Output.IsOutput(source):
            return {"value": _plain(source.Get(self._code))}
        node = UsdShade.Shader(source.GetPrim())
        kind = str(node.GetIdAttr().Get())
        if kind == TEXTURE:
            return self._texture(node) | {"output": UsdShade.Output(source).GetBaseName()}
        if kind.startswith(READER):
            return {"primvar": str(self._value(node, "varname") or ""), "value": self._value(node, "fallback")}
        self._ignored[f"shader nodes {kind}"] += 1
        return {}

    def _source(self, given: Any) -> Any:
        """Return the attribute that an input gets its value from, through the interfaces of materials and graphs."""
        found = given.GetValueProducingAttributes()
        return found[0] if found else None

    def _value(self, node: Any, name: str) -> Any:
        """Return the value of a node's input, None if it is neither set nor connected to a value."""
        from pxr import UsdShade

        given = node.GetInput(name)
        source = self._source(given) if given else None
        return None if source is None or UsdShade.Output.IsOutput(source) else _plain(source.Get(self._code))

    def _texture(self, node: Any) -> dict[str, Any]:
        facts = {name: self._value(node, name) for name in ("scale", "bias", "fallback")}
        facts["space"] = self._value(node, "sourceColorSpace")
        facts["wrap"] = [self._value(node, name) for name in ("wrapS", "wrapT")]
        facts["texture"] = self.image(node.GetInput("file"))
        return facts | self._coordinates(node)

    def image(self, given: Any) -> int | None:
        """Return the number of the image that an input refers to; None if it refers to none."""
        source = self._source(given) if given else None
        asset = None if source is None else source.Get(self._code)
        if asset is None or not getattr(asset, "path", ""):
            return None
        resolved = str(asset.resolvedPath)
        key = resolved or str(asset.path)
        if key not in self._textures:
            number = self._textures[key] = len(self.textures)
            packed = resolved.endswith("]") and "[" in resolved
            self.textures.append(
                {"name": str(asset.path), "path": None if packed else resolved or None, "packed": packed}
            )
            if packed:
                self._arrays[f"texture {number}"] = _content(resolved)
        return self._textures[key]

    def _coordinates(self, node: Any) -> dict[str, Any]:
        """Return the primvar that a texture's coordinates are read from, and their transform as numbers."""
        from pxr import UsdShade

        transform: dict[str, Any] = {}
        given = node.GetInput("st")
        for _ in range(MOST_NODES):
            source = self._source(given) if given else None
            if source is None or not UsdShade.Output.IsOutput(source):
                break
            node = UsdShade.Shader(source.GetPrim())
            kind = str(node.GetIdAttr().Get())
            if kind.startswith(READER):
                return {"uv": str(self._value(node, "varname") or ""), "transform": transform}
            if kind != TRANSFORM or transform:
                self._ignored[f"shader nodes {kind}"] += 1
                break
            transform = {name: self._value(node, name) for name in ("scale", "rotation", "translation")}
            given = node.GetInput("in")
        return {"uv": "st", "transform": transform}


def _content(resolved: str) -> Array:
    """Return the bytes of a file in an archive, (n,) uint8; none if it cannot be opened."""
    from pxr import Ar

    asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(resolved))
    if not asset or asset.GetSize() > MOST_BYTES:
        return np.zeros(0, np.uint8)
    with asset:
        return np.frombuffer(asset.Read(asset.GetSize(), 0), np.uint8)


def _plain(value: Any) -> Any:
    """Return a value of USD as numbers, text or lists of numbers."""
    if value is None or isinstance(value, str | bool | int | float):
        return value
    try:
        return [float(each) for each in value]
    except (TypeError, ValueError):
        return None
