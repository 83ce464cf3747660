"""XML parsed to elements that know their place, within bounds: no entities, limited depth and number of elements."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn
from xml.parsers import expat

from ...errors import SceneError

#: Maximum nesting depth of elements.
DEEPEST = 64
#: Maximum number of elements of a scene and the files that it includes.
MOST = 1_000_000


@dataclass(eq=False)
class Element:
    """An XML element. place: "line 12", of included files "parts.xml line 12"."""

    tag: str
    attrib: dict[str, str]
    place: str
    children: list[Element] = field(default_factory=list)

    def __iter__(self) -> Iterator[Element]:
        return iter(self.children)

    def get(self, name: str, default: str = "") -> str:
        """Return an attribute."""
        return self.attrib.get(name, default)


class ElementParser:
    """Parser of the files of one scene, which share the limit on elements."""

    def __init__(self) -> None:
        self._count = 0

    def root(self, path: Path, prefix: str = "") -> Element:
        """Return the root element of a file. prefix: of the elements' places. Raises SceneError."""
        document = Element("", {}, "")
        stack = [document]
        parser = expat.ParserCreate()

        def start(tag: str, attributes: dict[str, str]) -> None:
            place = f"{prefix}line {parser.CurrentLineNumber}"
            self._count += 1
            if len(stack) > DEEPEST or self._count > MOST:
                what = f"more than {MOST} elements" if self._count > MOST else f"elements more than {DEEPEST} deep"
                raise SceneError(f"{place}: the scene has {what}; store geometry in .ply or .obj files")
            stack[-1].children.append(Element(tag, attributes, place))
            stack.append(stack[-1].children[-1])

        def end(_: str) -> None:
            stack.pop()

        def entity(name: str, *_: object) -> NoReturn:
            raise SceneError(
                f'{prefix}line {parser.CurrentLineNumber}: declares the entity "{name}"; write its text, or a <default>'
            )

        parser.StartElementHandler, parser.EndElementHandler, parser.EntityDeclHandler = start, end, entity
        try:
            parser.Parse(path.read_bytes(), True)
        except (expat.ExpatError, ValueError, LookupError) as error:  # LookupError: an unknown encoding
            raise SceneError(f"{prefix}is not valid XML: {error}") from None
        return document.children[0]
