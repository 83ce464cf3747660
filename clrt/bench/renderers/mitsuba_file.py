"""Scenes in Mitsuba's own XML, which it reads itself: only image size, sampler and path depth are those of clrt's."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from ...errors import UsageError
from ...scene.model import RenderSettings

#: Parameters of a film that are replaced.
SIZE = ("width", "height", "crop_width", "crop_height", "crop_offset_x", "crop_offset_y")


def from_file(library: Any, file: Path, settings: RenderSettings, depth: int, sampler: str) -> Any:
    """Return the scene that Mitsuba reads from its file. Raises UsageError if it refuses the file."""
    library.file_resolver().prepend(str(file.parent.resolve()))
    try:
        return library.load_string(_adapted(file, settings, depth, sampler))
    except RuntimeError as error:
        raise UsageError(f"{file}: Mitsuba refuses it: {' '.join(str(error).split())}") from None


def _adapted(file: Path, settings: RenderSettings, depth: int, sampler: str) -> str:
    """Return the file's text with these settings."""
    root = ElementTree.parse(file).getroot()
    for integrator in root.findall("integrator"):
        root.remove(integrator)
    absorbs = root.find(".//medium") is not None
    chosen = ElementTree.SubElement(root, "integrator", type="volpath" if absorbs else "path")
    ElementTree.SubElement(chosen, "integer", name="max_depth", value=str(depth))
    for sensor in root.iter("sensor"):
        for old in sensor.findall("sampler"):
            sensor.remove(old)
        ElementTree.SubElement(sensor, "sampler", type=sampler)
        for film in sensor.findall("film"):
            for old in [each for each in film if each.get("name") in SIZE]:
                film.remove(old)
            for name, value in zip(SIZE, settings.size):
                ElementTree.SubElement(film, "integer", name=name, value=str(value))
    return ElementTree.tostring(root, encoding="unicode")
