"""Directives of a pbrt file and the files that it includes, within bounds.

The format: pbrt-v4's input file format, pbrt.org/fileformat-v4; that of v3 where the two differ.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import SceneError
from ..archives import gunzipped
from ..referenced_files import check_file
from .entities import NUMERIC, TYPES, WIDTHS, Files, Parameter
from .tokens import SHOWN, Token, Tokens

#: Maximum nesting depth of includes, their number, and the number of directives of a scene.
INCLUDES, MOST_INCLUDES, MOST = 15, 10_000, 2_000_000
#: Maximum number of bytes of a scene's files.
MOST_BYTES = 2**31

#: Directives by what follows them: numbers.
NUMBERS = {
    "Identity": 0,
    "Translate": 3,
    "Scale": 3,
    "Rotate": 4,
    "LookAt": 9,
    "Transform": 16,
    "ConcatTransform": 16,
    "TransformTimes": 2,
    "AttributeBegin": 0,
    "AttributeEnd": 0,
    "TransformBegin": 0,
    "TransformEnd": 0,
    "WorldBegin": 0,
    "WorldEnd": 0,
    "ObjectEnd": 0,
    "ReverseOrientation": 0,
}
#: One string or word, or two of which the second may be missing.
NAMED = (
    "CoordinateSystem",
    "CoordSysTransform",
    "ActiveTransform",
    "NamedMaterial",
    "ObjectBegin",
    "ObjectInstance",
    "ColorSpace",
)
#: A type and parameters.
TYPED = (
    "Camera",
    "Sampler",
    "Film",
    "PixelFilter",
    "Integrator",
    "Accelerator",
    "Attribute",
    "LightSource",
    "AreaLightSource",
    "Material",
    "MakeNamedMaterial",
    "MakeNamedMedium",
    "Shape",
    "SurfaceIntegrator",
    "VolumeIntegrator",
    "Renderer",
    "Volume",
)


class Directive(NamedTuple):
    """A directive. words: its strings; file: the one that it is in."""

    name: str
    place: str
    file: Path
    words: tuple[str, ...] = ()
    numbers: tuple[float, ...] = ()
    parameters: dict[str, Parameter] = {}


class Reader:
    """Reader of the directives of one scene."""

    def __init__(self, path: Path) -> None:
        self.files = Files(path)
        self._included, self._count, self._bytes = 0, 0, 0

    def directives(self, path: Path, prefix: str = "", depth: int = 0) -> Iterator[Directive]:
        """Yield the directives of a file; those of an imported one between AttributeBegin and AttributeEnd."""
        check_file(path, "scene")
        content = gunzipped(path) if path.suffix.lower() == ".gz" else path.read_bytes()
        self._bytes += len(content)
        if self._bytes > MOST_BYTES:
            raise SceneError(f"{prefix}line 1: the scene's files exceed {MOST_BYTES >> 30} GiB; use .ply files")
        tokens = Tokens(content, prefix)
        while tokens.peek() is not None:
            token = tokens.take("a directive")
            self._count += 1
            if self._count > MOST:
                raise SceneError(f"{tokens.place(token)}: the scene has more than {MOST} directives; use .ply files")
            if token.text in ("Include", "Import") and not token.is_string:
                place = tokens.place(token)
                name = tokens.take("a file name").text
                inner = self.included(name, path, place, depth + 1)
                if token.text == "Import":
                    yield Directive("AttributeBegin", place, path)
                yield from inner
                if token.text == "Import":
                    yield Directive("AttributeEnd", place, path)
            else:
                yield self._directive(token, tokens, path)

    def included(self, name: str, path: Path, place: str, depth: int) -> Iterator[Directive]:
        """Return the directives of an included file."""
        self._included += 1
        if depth > INCLUDES:
            raise SceneError(f"{place}: {name} is included more than {INCLUDES} files deep; include it once")
        if self._included > MOST_INCLUDES:
            raise SceneError(f"{place}: more than {MOST_INCLUDES} files are included; include fewer")
        found = self.files.path(name, path)
        if found == path and Path(name).name != name:  # a file of the same name elsewhere, which is missing
            found = self.files.scene.parent / name
        return self.directives(found, f"{found.name} ", depth)

    def _directive(self, token: Token, tokens: Tokens, path: Path) -> Directive:
        place, name = tokens.place(token), token.text
        if token.is_string:
            name = ""
        if name in NUMBERS:
            return Directive(name, place, path, numbers=tuple(tokens.numbers(NUMBERS[name], name)))
        if name in NAMED:
            return Directive(name, place, path, (tokens.take(f"the name of {name}").text,))
        if name == "MediumInterface":
            words = [tokens.take("the name of a medium").text]
            following = tokens.peek()
            words.append(tokens.take("a name").text if following and following.is_string else words[0])
            return Directive(name, place, path, tuple(words))
        if name == "Option":
            tokens.take("the name of an option")
            tokens.values("an option")
            return Directive(name, place, path)
        if name == "Texture":
            words = [tokens.take("a texture's name, type and kind").text for _ in range(3)]
            return Directive(name, place, path, tuple(words), parameters=_parameters(tokens))
        if name in TYPED:
            return Directive(name, place, path, (tokens.take(f"the type of {name}").text,), (), _parameters(tokens))
        known = ", ".join(sorted((*NUMBERS, *NAMED, *TYPED, "Texture", "Include")))
        raise SceneError(f"{place}: {token.text:.{SHOWN}} is not a directive of pbrt; write one of {known}")


def _parameters(tokens: Tokens) -> dict[str, Parameter]:
    """Read the parameters that follow, each a string such as "float radius" and its values."""
    found: dict[str, Parameter] = {}
    while (token := tokens.peek()) is not None and token.is_string:
        tokens.take("a parameter")
        words = token.text.split(None, 1)
        given, name = words[0] if words else "", words[-1].strip() if words else ""
        kind = TYPES.get(given)
        if kind is None or len(words) < 2:
            raise SceneError(
                f'{tokens.place(token)}: "{token.text:.{SHOWN}}" is not a parameter; write a type, a space and a name, '
                f'such as "float radius"; types are {", ".join(TYPES)}'
            )
        values = tokens.values(name)
        is_numeric = isinstance(values, np.ndarray)
        if kind in NUMERIC and not is_numeric or kind in ("string", "texture") and is_numeric and len(values):
            raise SceneError(f'{tokens.place(token)}: "{name}" is not of type {given}; write {given} values')
        if kind in WIDTHS and len(values) % WIDTHS[kind]:
            raise SceneError(
                f'{tokens.place(token)}: "{name}" has {len(values)} numbers; write a multiple of {WIDTHS[kind]}'
            )
        found[name] = Parameter(kind, values)
    return found
