"""Wavefront OBJ and MTL through trimesh's parser, with what it leaves undone."""

from __future__ import annotations

import io
import logging
import re
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import SceneError
from .materials import Diffuse

log = logging.getLogger(__name__)


def parse_obj(path: Path) -> dict[str, Any]:
    """trimesh's keyword arguments for the file: {"geometry": {name: arrays}}, one geometry per material."""
    from trimesh.exchange.obj import load_obj

    text = absolute_indices(_text(path))
    parts: dict[str, Any] = load_obj(io.StringIO(text), resolver=_Libraries(path))
    return parts


def absolute_indices(text: str) -> str:
    """The file with its relative indices (−1 = the latest vertex so far) made absolute.

    trimesh counts them from the end of the file, which is wrong where faces and vertices alternate. Raises SceneError
    for an index 0, which trimesh takes for 1.
    """
    if re.search(r"^f.*[ \t]0(?:[/\s]|$)", text, re.MULTILINE):
        raise SceneError("a face uses vertex 0, but OBJ counts from 1; repair the file")
    if not re.search(r"^f.*[ \t/]-", text, re.MULTILINE):
        return text
    counts = {"v": 0, "vt": 0, "vn": 0}
    lines = text.splitlines()
    for number, line in enumerate(lines):
        key, *entries = line.split() or [""]
        if key in counts:
            counts[key] += 1
        elif key == "f":
            corners = [zip(entry.split("/"), counts.values()) for entry in entries]
            lines[number] = "f " + " ".join(
                "/".join(str(count + int(index) + 1) if index.startswith("-") else index for index, count in corner)
                for corner in corners)
    return "\n".join(lines)


def obj_material(visual: Any) -> Diffuse:
    """The material of one geometry: Kd as color, within [0, 1], and Ke as emission."""
    values = getattr(getattr(visual, "material", None), "kwargs", {})
    return Diffuse(color=_rgb(values.get("kd", 0.8), 1.0), emission=_rgb(values.get("ke", 0.0), np.inf))


def _rgb(values: Any, most: float) -> tuple[float, float, float]:
    """One or three numbers (MTL's values come as numbers or text) as a colour from 0 to `most`."""
    try:
        red, green, blue = np.broadcast_to(np.asarray(values, np.float64), 3).clip(0, most).tolist()
    except ValueError:
        raise SceneError(f"a material's colour is {values}; write three numbers in the material library") from None
    return red, green, blue


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8", errors="replace")


class _Libraries(dict[str, str]):
    """Finds for trimesh the material libraries beside an OBJ file; it gets no textures."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.path = path
        self.file_name = path.stem

    def __missing__(self, name: str) -> str:
        """The text of the library `name`; where it is missing, of the one with the model's own name."""
        library, own = self.path.with_name(name), self.path.with_suffix(".mtl")
        if not library.is_file():
            log.warning("%s: no material library %s; %s", self.path, name,
                        f"took {own.name}" if own.is_file() else "its materials are plain grey")
            library = own
        text = _text(library)
        if "map_" in text:
            log.warning("%s: its textures are left out", library)
        return text
