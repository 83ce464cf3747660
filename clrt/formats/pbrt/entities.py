"""Directives with parameters, such as Shape "sphere" "float radius" 2."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple, NoReturn

import numpy as np

from ...errors import SceneError
from ..referenced_files import find_file
from ..scene_parts.notes import UnsupportedError
from .tokens import SHOWN, Doubles, Values

#: Types of parameters, by their names in files.
TYPES = {
    "float": "float",
    "integer": "integer",
    "int": "integer",
    "bool": "bool",
    "string": "string",
    "texture": "texture",
    "point": "point3",
    "point2": "point2",
    "point3": "point3",
    "vector": "vector3",
    "vector2": "vector2",
    "vector3": "vector3",
    "normal": "normal",
    "normal3": "normal",
    "rgb": "rgb",
    "color": "rgb",
    "xyz": "xyz",
    "spectrum": "spectrum",
    "blackbody": "blackbody",
}
#: Number of numbers of one value.
WIDTHS = {"point2": 2, "vector2": 2, "point3": 3, "vector3": 3, "normal": 3, "rgb": 3, "xyz": 3}
NUMERIC = ("float", "integer", "point2", "point3", "vector2", "vector3", "normal", "rgb", "xyz", "blackbody")
#: Types of colors.
SPECTRA = ("rgb", "xyz", "spectrum", "blackbody")


class Parameter(NamedTuple):
    """A value such as "float radius" 2. type: one of the values of TYPES."""

    type: str
    values: Values


@dataclass(frozen=True)
class Files:
    """Where the files that a scene names are looked for. scene: its first file."""

    scene: Path

    def path(self, name: str, including: Path) -> Path:
        """Return the path of a file: relative to the scene, or else to the file that names it."""
        found = find_file(self.scene, [self.scene.parent, including.parent], name)
        return found or self.scene.parent / name.replace("\0", "")


@dataclass(eq=False)
class Entity:
    """A directive with parameters. tag: "Shape"; kind: "sphere"; name: of a texture or a named material; place: its
    line; to_world: the transformation then in effect; to_world_end: that at its end, if that is another one; space: the
    color space of its colors.

    Parameters that were read are in `used`, so that a reader can report the others; `inherited` ones come from
    Attribute directives. textures: those that its parameters name, as far as they were defined before it.
    """

    tag: str
    kind: str
    place: str = ""
    parameters: dict[str, Parameter] = field(default_factory=dict)
    name: str = ""
    value_type: str = ""
    to_world: Doubles = field(default_factory=lambda: np.eye(4))
    space: str = "srgb"
    files: Files = field(default_factory=lambda: Files(Path("-")))
    file: Path = Path("-")
    inherited: frozenset[str] = frozenset()
    textures: Mapping[tuple[str, str], Entity] = field(default_factory=dict)
    used: set[str] = field(default_factory=set)
    to_world_end: Doubles | None = None

    @property
    def where(self) -> str:
        """Its name in messages and of meshes."""
        return f'{self.tag} "{self.name or self.kind}"'

    @property
    def at(self) -> str:
        """Its place and name in messages."""
        return f"{self.place}: {self.where}" if self.place else self.where

    def fault(self, name: str, what: str, remedy: str) -> SceneError:
        """Return the error for a parameter."""
        return SceneError(f'{self.at}: "{name}" {what}; {remedy}')

    def get(self, name: str, *types: str) -> Parameter | None:
        """Return a parameter of one of the types; None if there is none. Raises SceneError for other types."""
        self.used.add(name)
        found = self.parameters.get(name)
        if found is not None and found.type not in types:
            raise self.fault(name, f"is of type {found.type}", f'write "{types[0]} {name}"')
        return found

    def number(self, name: str, default: float) -> float:
        """Return a number."""
        found = self.get(name, "float", "integer")
        return default if found is None else self._first(name, found)

    def integer(self, name: str, default: int) -> int:
        """Return an integer."""
        found = self.get(name, "integer", "float")
        value = float(default) if found is None else self._first(name, found)
        if value != int(value):
            raise self.fault(name, f"is {value:g}", "write an integer")
        return int(value)

    def boolean(self, name: str, default: bool) -> bool:
        """Return a boolean, which v3 files write as a string."""
        found = self.get(name, "bool", "string")
        if found is None:
            return default
        value = found.values[0] if len(found.values) else None
        if value not in (True, False, "true", "false"):
            raise self.fault(name, f"is {value!s:.{SHOWN}}", "write true or false")
        return value in (True, "true")

    def string(self, name: str, default: str) -> str:
        """Return a string."""
        found = self.get(name, "string", "texture")
        return default if found is None or not len(found.values) else str(found.values[0])

    def path(self, name: str) -> str:
        """Return the path of a file that a parameter names; empty if it does not."""
        return str(self.files.path(text, self.file)) if (text := self.string(name, "")) else ""

    def rows(self, name: str, width: int, *types: str) -> Doubles | None:
        """Return numbers as rows (n, width); None if the parameter is missing."""
        found = self.get(name, *types)
        if found is None:
            return None
        values = np.asarray(found.values, np.float64)
        if len(values) % width:
            raise self.fault(name, f"has {len(values)} numbers", f"write a multiple of {width}")
        return values.reshape(-1, width)

    def point(self, name: str, default: tuple[float, float, float]) -> Doubles:
        """Return a point or vector (3,)."""
        rows = self.rows(name, 3, "point3", "vector3", "normal")
        return np.array(default) if rows is None or not len(rows) else rows[0]

    def indices(self, name: str, count: int, width: int, default: Doubles | None) -> Doubles:
        """Return indices (m, width) below `count`."""
        rows = self.rows(name, width, "integer", "float")
        rows = default if rows is None else rows
        if rows is None or not len(rows):
            raise self.fault(name, "is missing", "add it")
        if rows.min() < 0 or rows.max() >= count or (rows != np.floor(rows)).any():
            worst = rows.max() if rows.max() >= count else rows.min()
            raise self.fault(name, f"contains {worst:g}", f"write integers from 0 to {count - 1}")
        return rows.astype(np.int64)

    def _first(self, name: str, parameter: Parameter) -> float:
        if not len(parameter.values):
            raise self.fault(name, "has no value", "write a number")
        return float(parameter.values[0])

    def texture(self, name: str, value_type: str) -> Entity:
        """Return the texture that a parameter of type texture names. value_type: "float" or "spectrum"."""
        called = self.string(name, "")
        other = "float" if value_type == "spectrum" else "spectrum"
        found = self.textures.get((value_type, called)) or self.textures.get((other, called))
        if found is None:
            raise self.fault(name, f'names the texture "{called}", which is not defined', "define it")
        return found

    def is_textured(self, name: str) -> bool:
        """Return whether a parameter is a texture."""
        return name in self.parameters and self.parameters[name].type == "texture"

    def ignore(self, names: Iterable[str] = ()) -> None:
        """Count parameters as read, all if none is named."""
        self.used.update(names or self.parameters)

    def unread(self) -> list[str]:
        """Return the names of its own parameters that were not read."""
        return sorted({*self.parameters} - self.used - self.inherited)

    def refuse(self, what: str, remedy: str, feature: str = "") -> NoReturn:
        """Raise UnsupportedError: "line N: WHERE: what; remedy"."""
        raise UnsupportedError(f"{self.at}: {what}; {remedy}", [feature or f"{self.tag} {self.kind}"])
