"""Mitsuba 3's XML as a tree of plugins, with defaults, includes, references and transforms resolved.

The format: Mitsuba 3's manual, "Scene XML file format"; W. Jakob et al., 2022.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn, TypeVar
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from ...errors import SceneError
from ..referenced_files import check_file
from .values import Color, Doubles, Spectrum, Value, value_of

Kind = TypeVar("Kind")

VALUES = ("float", "integer", "boolean", "string", "rgb", "spectrum", "point", "vector", "transform")
PLUGINS = (
    "scene",
    "integrator",
    "sensor",
    "film",
    "rfilter",
    "sampler",
    "emitter",
    "shape",
    "bsdf",
    "texture",
    "medium",
    "phase",
    "volume",
)
#: Maximum nesting depth of includes.
DEEPEST = 15


class UnsupportedError(SceneError):
    """A scene uses unsupported features. `features`: their names, two or three words each."""

    def __init__(self, problems: str | list[str], features: list[str]) -> None:
        super().__init__(problems)
        self.features = features


@dataclass(eq=False)
class Plugin:
    """An element such as <bsdf type="diffuse">. tag: "bsdf"; kind: "diffuse"; where: its name in messages.

    Parameters that were read are in `used`, so that a reader can report the others.
    """

    tag: str
    kind: str
    where: str
    values: dict[str, Value] = field(default_factory=dict)
    children: list[tuple[str, Plugin]] = field(default_factory=list)
    used: set[str] = field(default_factory=set)

    def value(self, name: str, kind: type[Kind], default: Kind) -> Kind:
        """Return a parameter of a plain type; raises SceneError if it has another type."""
        self.used.add(name)
        value = self.values.get(name, default)
        if kind is float and isinstance(value, int) and not isinstance(value, bool):
            value = float(value)
        if not isinstance(value, kind) or isinstance(value, bool) != (kind is bool):
            raise SceneError(f'{self.where}: "{name}" is not of type {kind.__name__}; write one')
        return value

    def color(self, name: str, default: float) -> float | Color | Spectrum:
        """Return a parameter that is a number, a color or a spectrum."""
        self.used.add(name)
        value = self.values.get(name, default)
        if isinstance(value, bool) or not isinstance(value, (int, float, Color, Spectrum)):
            raise SceneError(f'{self.where}: "{name}" is not a color; write <rgb name="{name}" value="…"/>')
        return value

    def point(self, name: str) -> tuple[float, float, float] | None:
        """Return a point or vector, None if it is missing."""
        self.used.add(name)
        value = self.values.get(name)
        if value is not None and not isinstance(value, tuple) or isinstance(value, (Color, Spectrum)):
            raise SceneError(f'{self.where}: "{name}" is not three numbers; write <point name="{name}" value="…"/>')
        return value

    def transform(self, name: str) -> Doubles:
        """Return a transform (4, 4), the identity if it is missing."""
        self.used.add(name)
        value = self.values.get(name)
        if value is not None and not isinstance(value, np.ndarray):
            raise SceneError(f'{self.where}: "{name}" is not a transform; write <transform name="{name}">')
        return np.eye(4) if value is None else value

    def all(self, tag: str) -> list[Plugin]:
        """Return the children with this tag."""
        found = [(name, child) for name, child in self.children if child.tag == tag]
        self.used.update(name for name, _ in found)
        return [child for _, child in found]

    def child(self, name: str) -> Plugin | None:
        """Return the child with this name, if there is one."""
        self.used.add(name)
        return next((child for own, child in self.children if own == name), None)

    def unread(self) -> list[str]:
        """Return the names of parameters that were not read."""
        return sorted(({*self.values} | {name for name, _ in self.children}) - self.used)

    def refuse(self, what: str, remedy: str, feature: str = "") -> NoReturn:
        """Raise UnsupportedError: "WHERE: what; remedy"."""
        raise UnsupportedError(f"{self.where}: {what}; {remedy}", [feature or f"{self.tag} {self.kind}"])

    def refuse_kind(self, known: str) -> NoReturn:
        """Raise UnsupportedError for the plugin's type."""
        self.refuse(f'{self.tag} type "{self.kind}" is not supported', f"use {known}")


def read_xml(path: Path) -> Plugin:
    """Read the scene in an XML file. Raises SceneError if it is malformed or has a dangling reference."""
    return _Document(path).scene()


class _Document:
    def __init__(self, path: Path) -> None:
        self._path = path
        self._folders = [path.parent]
        self._defaults: dict[str, str] = {}
        self._by_id: dict[str, Plugin] = {}
        self._references: list[tuple[Plugin, int, str]] = []
        self._counts: dict[str, int] = {}

    def scene(self) -> Plugin:
        root = self._root(self._path)
        scene = Plugin("scene", "scene", "scene")
        self._read_children(root, scene, 0)
        for owner, place, name in self._references:
            if name not in self._by_id:
                raise SceneError(f'{owner.where}: refers to "{name}", but nothing has that id; define it')
            owner.children[place] = owner.children[place][0], self._by_id[name]
        return scene

    def _root(self, path: Path) -> Element:
        check_file(path, "scene")
        try:
            root = ElementTree.parse(path).getroot()
        except (ElementTree.ParseError, ValueError, RecursionError) as error:
            raise SceneError(
                f"is not valid XML: {error}" if path == self._path else f"{path.name}: is not valid XML: {error}"
            ) from None
        if root.tag != "scene":
            raise SceneError(f"{path.name}: begins with <{root.tag}>; a Mitsuba scene begins with <scene>")
        return root

    def _read_children(self, element: Element, owner: Plugin, depth: int) -> None:
        for child in element:
            self._substitute(child, owner.where)
            name = child.get("name", "")
            if child.tag == "default":
                self._defaults.setdefault(name, child.get("value", ""))
            elif child.tag == "path":
                self._folders.insert(0, self.file(child.get("value", "")))
            elif child.tag == "include":
                self._include(child.get("filename", ""), owner, depth + 1)
            elif child.tag == "alias":
                self._by_id[child.get("as", "")] = self._known(child.get("id", ""), owner)
            elif child.tag == "ref":
                self._references.append((owner, len(owner.children), child.get("id", "")))
                owner.children.append((name, owner))
            elif child.tag in PLUGINS:
                owner.children.append((name, self._plugin(child, owner, depth)))
            elif child.tag in VALUES:
                for step in child:
                    self._substitute(step, owner.where)
                if "filename" in child.attrib:
                    owner.refuse(f'<{child.tag} name="{name}"> in a file', "write its values", "spectrum file")
                value = value_of(child, f"{owner.where}.{name}")
                owner.values[name] = str(self.file(str(value))) if name == "filename" else value
            else:
                raise SceneError(
                    f"{owner.where}: <{child.tag}> is unknown; write one of "
                    f"{', '.join((*VALUES, *PLUGINS[1:], 'ref', 'include', 'default'))}"
                )

    def _plugin(self, element: Element, owner: Plugin, depth: int) -> Plugin:
        kind, name = element.get("type", ""), element.get("id", "")
        if name:
            where = f'{element.tag} "{name}"'
        elif owner.tag == "scene":
            number = self._counts[element.tag] = self._counts.get(element.tag, -1) + 1
            where = f"{element.tag}[{number}]"
        else:
            where = f"{owner.where}.{element.get('name') or element.tag}"
        plugin = Plugin(element.tag, kind, where)
        if name in self._by_id:
            raise SceneError(f"{where}: the id is used twice; rename one")
        if name:
            self._by_id[name] = plugin
        self._read_children(element, plugin, depth)
        return plugin

    def _include(self, filename: str, owner: Plugin, depth: int) -> None:
        if depth > DEEPEST:
            raise SceneError(f"{filename}: is included more than {DEEPEST} files deep; include it once")
        path = self.file(filename)
        self._read_children(self._root(path), owner, depth)

    def _known(self, name: str, owner: Plugin) -> Plugin:
        if name not in self._by_id:
            raise SceneError(f'{owner.where}: is an alias of "{name}", but nothing before it has that id; define it')
        return self._by_id[name]

    def file(self, name: str) -> Path:
        """Return the path of a file named in the scene: next to it, or in a <path> folder, the last one first."""
        found = (folder / name for folder in self._folders)
        return next((path for path in found if path.exists()), self._path.parent / name)

    def _substitute(self, element: Element, where: str) -> None:
        """Replace $NAME in attributes by the value of its <default>."""

        def said(match: re.Match[str]) -> str:
            if match[1] not in self._defaults:
                raise SceneError(f'{where}: ${match[1]} is undefined; write <default name="{match[1]}" …/>')
            return self._defaults[match[1]]

        for key, text in element.attrib.items():
            if "$" in text:
                element.set(key, re.sub(r"\$(\w+)", said, text))
