"""Names of Mitsuba 0.x, which Mitsuba 3 replaces when it reads old files, and which this does in the same way."""

from __future__ import annotations

import re

from .elements import Element

#: Before this version names were in camel case.
RENAMED = 2
_HUMP = re.compile("([a-z])([A-Z]+)")


def is_old(version: str) -> bool:
    """Return whether a scene of this version, or without one, is in Mitsuba 0.x's dialect."""
    major = version.strip().partition(".")[0]
    return not major.isdecimal() or int(major[:9]) < RENAMED


def modernize(element: Element) -> None:
    """Rename parameters such as intIOR to int_ior, and replace what has changed in other ways."""
    for child in element:
        if child.tag != "default" and "name" in child.attrib:
            child.attrib["name"] = _HUMP.sub(lambda found: f"{found[1]}_{found[2].lower()}", child.get("name"))
        if child.tag == "lookAt":
            child.tag = "lookat"
        modernize(child)
    if element.tag == "bsdf" and element.get("type") == "diffuse":
        for child in element:
            if child.get("name") == "diffuse_reflectance":
                child.attrib["name"] = "reflectance"
    _place_textures(element)
    if element.tag == "emitter" and element.get("type") in ("sky", "sun", "sunsky"):
        _erect(element)


#: Albedo of the ground below a sky, by default.
OLD_ALBEDO = "0.2"


def _erect(sky: Element) -> None:
    """Turn a sky whose zenith is +y, north −z and east +x to Mitsuba 3's: its zenith is +z, and it is mirrored, with
    south along +x and west along +y."""
    transform = next((child for child in sky if child.tag == "transform"), None)
    if transform is None:
        transform = Element("transform", {"name": "to_world"}, sky.place)
        sky.children.append(transform)
    transform.children.insert(0, Element("matrix", {"value": "0 -1 0 0 0 1 1 0 0"}, sky.place))
    if not any(child.get("name") == "albedo" for child in sky):
        sky.children.append(Element("spectrum", {"name": "albedo", "value": OLD_ALBEDO}, sky.place))


def _place_textures(element: Element) -> None:
    """Replace the numbers uscale, vscale, uoffset and voffset by a transform `to_uv`."""
    found = {child.get("name"): child for child in element if child.tag == "float"}
    steps = []
    for step, end in (("translate", "offset"), ("scale", "scale")):
        axes = {axis: found[name] for axis, name in (("x", f"u{end}"), ("y", f"v{end}")) if name in found}
        if axes:
            steps.append(Element(step, {axis: child.get("value") for axis, child in axes.items()}, element.place))
            element.children = [child for child in element if child not in axes.values()]
    if steps:
        element.children.append(Element("transform", {"name": "to_uv"}, element.place, steps))
