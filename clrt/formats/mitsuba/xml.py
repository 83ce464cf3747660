"""Mitsuba's XML as a tree of plugins, with defaults, includes, references and transforms resolved.

The format: Mitsuba 3's manual, "Scene XML file format"; W. Jakob et al., 2022. Files of Mitsuba 0.x are read as it
reads them.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn, TypeVar

import numpy as np

from ...errors import SceneError, did_you_mean
from ..referenced_files import check_file, find_file
from ..scene_parts.notes import UnsupportedError
from .dialect import is_old, modernize
from .elements import DEEPEST, Element, ElementParser
from .values import READERS, Color, Doubles, Spectrum, Value, value_of

Kind = TypeVar("Kind")

VALUES = (*READERS, "point", "vector", "transform")
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
#: Maximum nesting depth of includes, and their number.
INCLUDES, MOST_INCLUDES = 15, 1000
#: Maximum number of characters that all uses of defaults may be replaced by.
LONGEST = 10_000_000


@dataclass(eq=False)
class Plugin:
    """An element such as <bsdf type="diffuse">. tag: "bsdf"; kind: "diffuse"; where: its name; place: its line.

    Parameters that were read are in `used`, so that a reader can report the others.
    """

    tag: str
    kind: str
    where: str
    place: str = ""
    values: dict[str, Value] = field(default_factory=dict)
    children: list[tuple[str, Plugin]] = field(default_factory=list)
    used: set[str] = field(default_factory=set)

    @property
    def at(self) -> str:
        """Its place and name in messages."""
        return f"{self.place}: {self.where}" if self.place else self.where

    def value(self, name: str, kind: type[Kind], default: Kind) -> Kind:
        """Return a parameter of a plain type; raises SceneError if it has another type."""
        self.used.add(name)
        value = self.values.get(name, default)
        if kind is float and isinstance(value, int) and not isinstance(value, bool):
            value = float(value)
        if not isinstance(value, kind) or isinstance(value, bool) != (kind is bool):
            raise SceneError(f'{self.at}: "{name}" is not of type {kind.__name__}; write one')
        return value

    def color(self, name: str, default: float) -> float | Color | Spectrum:
        """Return a parameter that is a number, a color or a spectrum."""
        self.used.add(name)
        value = self.values.get(name, default)
        if isinstance(value, bool) or not isinstance(value, (int, float, Color, Spectrum)):
            raise SceneError(f'{self.at}: "{name}" is not a color; write <rgb name="{name}" value="…"/>')
        return value

    def point(self, name: str) -> tuple[float, float, float] | None:
        """Return a point or vector, None if it is missing."""
        self.used.add(name)
        value = self.values.get(name)
        if value is not None and not isinstance(value, tuple) or isinstance(value, (Color, Spectrum)):
            raise SceneError(f'{self.at}: "{name}" is not three numbers; write <point name="{name}" value="…"/>')
        return value

    def transform(self, name: str) -> Doubles:
        """Return a transform (4, 4), the identity if it is missing."""
        self.used.add(name)
        value = self.values.get(name)
        if value is not None and not isinstance(value, np.ndarray):
            raise SceneError(f'{self.at}: "{name}" is not a transform; write <transform name="{name}">')
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

    def ignore(self) -> None:
        """Count all parameters as read."""
        self.used.update(self.values, (name for name, _ in self.children))

    def unread(self) -> list[str]:
        """Return the names of parameters that were not read."""
        return sorted(({*self.values} | {name for name, _ in self.children}) - self.used)

    def refuse(self, what: str, remedy: str, feature: str = "") -> NoReturn:
        """Raise UnsupportedError: "line N: WHERE: what; remedy"."""
        raise UnsupportedError(f"{self.at}: {what}; {remedy}", [feature or f"{self.tag} {self.kind}"])

    def refuse_kind(self, known: str) -> NoReturn:
        """Raise UnsupportedError for the plugin's type."""
        self.refuse(f'{self.tag} type "{self.kind}" is not supported', f"use {known}")


def read_xml(path: Path, parameters: Mapping[str, str] = {}) -> Plugin:
    """Read the scene in an XML file. parameters: values of $NAME, which replace the <default> ones.

    Raises SceneError if the file is malformed, has a dangling reference, or has no such parameter.
    """
    return _Document(path, parameters).scene()


class _Document:
    def __init__(self, path: Path, parameters: Mapping[str, str]) -> None:
        self._path = path
        self._parser = ElementParser()
        self._folders = [path.parent]
        self._given = parameters
        self._defaults = {**parameters}
        self._parameters: dict[str, None] = {}
        self._substituted = 0
        self._included = 0
        self._by_id: dict[str, Plugin] = {}
        self._references: list[tuple[Plugin, int, str]] = []
        self._counts: dict[str, int] = {}

    def scene(self) -> Plugin:
        root = self._root(self._path)
        scene = Plugin("scene", "scene", "scene")
        self._read_children(root, scene, 0)
        self._check_parameters()
        for owner, place, name in self._references:
            if name not in self._by_id:
                raise SceneError(f'{owner.at}: refers to "{name}", but nothing has that id; define it')
            owner.children[place] = owner.children[place][0], self._by_id[name]
        _check_nesting(scene)
        return scene

    def _root(self, path: Path) -> Element:
        check_file(path, "scene")
        prefix = "" if path == self._path else f"{path.name} "
        root = self._parser.root(path, prefix)
        if root.tag != "scene":
            raise SceneError(f"{prefix}begins with <{root.tag}>; a Mitsuba scene begins with <scene>")
        if is_old(root.get("version")):
            modernize(root)
        return root

    def _read_children(self, element: Element, owner: Plugin, depth: int) -> None:
        for child in element:
            self._substitute(child)
            name = child.get("name")
            if child.tag == "default":
                self._parameters[name] = None
                self._defaults.setdefault(name, child.get("value"))
            elif child.tag == "path":
                self._folders.insert(0, self._folder(child.get("value")))
            elif child.tag == "include":
                self._include(child, owner, depth + 1)
            elif child.tag == "alias":
                self._by_id[child.get("as")] = self._known(child)
            elif child.tag == "ref":
                self._references.append((owner, len(owner.children), child.get("id")))
                owner.children.append((name, owner))
            elif child.tag in PLUGINS:
                owner.children.append((name, self._plugin(child, owner, depth)))
            elif child.tag in VALUES:
                owner.values[name] = self._value(child, owner)
            else:
                raise SceneError(
                    f"{child.place}: {owner.where}: <{child.tag}> is unknown; write one of "
                    f"{', '.join((*VALUES, *PLUGINS[1:], 'ref', 'include', 'default'))}"
                )

    def _value(self, element: Element, owner: Plugin) -> Value:
        for step in element:
            self._substitute(step)
        name = element.get("name")
        if "filename" in element.attrib or "type" in element.attrib:
            what = "in a file" if "filename" in element.attrib else f'of type "{element.get("type")}"'
            owner.refuse(
                f'<{element.tag} name="{name}"> {what} is not supported', "write its values", f"spectrum {what}"
            )
        value = value_of(element, f"{element.place}: {owner.where}.{name}")
        return str(self.file(str(value))) if name == "filename" else value

    def _plugin(self, element: Element, owner: Plugin, depth: int) -> Plugin:
        kind, name = element.get("type"), element.get("id")
        if name:
            where = f'{element.tag} "{name}"'
        elif owner.tag == "scene":
            number = self._counts[element.tag] = self._counts.get(element.tag, -1) + 1
            where = f"{element.tag}[{number}]"
        else:
            where = f"{owner.where}.{element.get('name') or element.tag}"
        plugin = Plugin(element.tag, kind, where, element.place)
        if name in self._by_id:
            raise SceneError(f"{plugin.at}: the id is used twice; rename one")
        if name:
            self._by_id[name] = plugin
        self._read_children(element, plugin, depth)
        return plugin

    def _include(self, element: Element, owner: Plugin, depth: int) -> None:
        filename = element.get("filename")
        if depth > INCLUDES:
            raise SceneError(f"{filename}: is included more than {INCLUDES} files deep; include it once")
        self._included += 1
        if self._included > MOST_INCLUDES:
            raise SceneError(f"{element.place}: more than {MOST_INCLUDES} files are included; include fewer")
        self._read_children(self._root(self.file(filename)), owner, depth)

    def _known(self, element: Element) -> Plugin:
        name = element.get("id")
        if name not in self._by_id:
            raise SceneError(f'{element.place}: an alias of "{name}", but nothing before it has that id; define it')
        return self._by_id[name]

    def file(self, name: str) -> Path:
        """Return the path of a file named in the scene: next to it, or in a <path> folder, the last one first."""
        return find_file(self._path, self._folders, name) or self._path.parent / name

    def _folder(self, name: str) -> Path:
        return next((folder / name for folder in self._folders if (folder / name).is_dir()), self._path.parent / name)

    def _substitute(self, element: Element) -> None:
        """Replace $NAME in attributes by the value of its <default>."""

        def said(match: re.Match[str]) -> str:
            self._parameters[match[1]] = None
            if match[1] not in self._defaults:
                raise SceneError(
                    f'{element.place}: ${match[1]} is undefined; write <default name="{match[1]}" …/>, or give it with '
                    f"-D {match[1]}=VALUE{did_you_mean(match[1], self._defaults)}"
                )
            self._substituted += len(self._defaults[match[1]])
            if self._substituted > LONGEST:
                raise SceneError(
                    f"{element.place}: its defaults expand to more than {LONGEST} characters; shorten them"
                )
            return self._defaults[match[1]]

        for key, text in element.attrib.items():
            if "$" in text:
                element.attrib[key] = re.sub(r"\$(\w+)", said, text)

    def _check_parameters(self) -> None:
        """Raise SceneError for given parameters that the scene has not."""
        unknown = [name for name in self._given if name not in self._parameters]
        has = f"it has {', '.join(self._parameters)}" if self._parameters else "it has none; leave it out"
        if unknown:
            raise SceneError(
                [
                    f"-D {name}: the scene has no such parameter; {has}{did_you_mean(name, self._parameters)}"
                    for name in unknown
                ]
            )


def _check_nesting(scene: Plugin) -> None:
    """Raise SceneError if a plugin refers to itself, or if references nest too deep."""
    heights: dict[Plugin, int] = {}

    def height(plugin: Plugin, above: tuple[Plugin, ...]) -> int:
        if plugin in above or len(above) > DEEPEST:
            raise SceneError(f"{plugin.at}: refers to itself, or nests more than {DEEPEST} deep; remove a <ref>")
        if plugin not in heights:
            within = [height(child, (*above, plugin)) for _, child in plugin.children]
            heights[plugin] = 1 + max(within, default=0)
        return heights[plugin]

    if height(scene, ()) > DEEPEST:
        raise SceneError(f"scene: its references nest more than {DEEPEST} deep; remove some")
