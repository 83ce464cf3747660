"""The material libraries that an OBJ file refers to."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from pathlib import Path

from ...errors import SceneError
from ...file_names import printable
from ...scene.materials.material_types import Material
from ..plain_text import plain_text
from ..referenced_files import find_file, note_read
from .mtl import MtlMaterial, left_out, material, read_library
from .mtl_maps import Maps

log = logging.getLogger(__name__)


def read_libraries(path: Path, names: list[str], used: Iterable[str]) -> dict[str, Material]:
    """Return the materials in the libraries of the OBJ file at `path`. For a missing one, and if materials are `used`
    without any, the library named like the OBJ file is read."""
    own = path.with_suffix(".mtl")
    files = [file for name in names for file in _files(path, name, own)]
    if not names and any(used) and own.is_file():
        files = [own]
    entries: dict[str, MtlMaterial] = {}
    materials: dict[str, Material] = {}
    ignored: set[str] = set()
    for file in dict.fromkeys(files):
        try:
            library = read_library(_text(file))
        except SceneError as error:
            raise SceneError([f"{file.name}: {problem}" for problem in error.problems]) from None
        maps = Maps(path, file.parent)
        materials |= {name: material(entry, maps) for name, entry in library.items()}
        entries |= library
        ignored |= maps.ignored
    if words := left_out(entries, ignored):
        log.warning("%s: ignored: %s", path, ", ".join(words))
    return materials


def _files(path: Path, names: str, own: Path) -> list[Path]:
    """Return the existing files on a mtllib line: one name, which may contain spaces, or several."""
    if found := find_file(path, [path.parent], names):
        return [found]
    files = []
    for name in names.split():
        file = find_file(path, [path.parent], name)
        if file is None:
            instead = f"using {own.name}" if own.is_file() else "its materials are plain gray"
            log.warning("%s: no material library %s; %s", path, printable(Path(name).name), instead)
            file = own if own.is_file() else None
        files += [file] if file else []
    return files


def _text(path: Path) -> str:
    """Read the file as UTF-8; other bytes become surrogates, as in file names."""
    return plain_text(note_read(path).read_bytes()).decode("utf-8", "surrogateescape")
