"""Scenes of others in Mitsuba's XML, read and rendered by clrt and by Mitsuba.

CLRT_MITSUBA_SCENES: files, separated by colons. What Mitsuba 3 does not read of files of Mitsuba 0.x is replaced for
both in a copy next to the file, and named.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from importlib import import_module
from math import hypot
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from clrt.api import load, render
from clrt.errors import SceneError
from clrt.formats.mitsuba.values import encoded_color

#: Pixels of the longer side, samples per pixel, images with different seeds, and the maximum path depth.
LONGEST, SPP, SEEDS, DEPTH = 160, 24, 4, 8
#: What Mitsuba 3 lacks of Mitsuba 0.x, and what replaces it for both.
LACKING = {"phong": "diffuse", "ward": "diffuse", "roughdiffuse": "diffuse", "sunsky": "constant", "sky": "constant"}
#: Parameters that change nothing here, or only how an image is stored.
LEFT_OUT = ("extEta", "ext_eta", "maxAnisotropy", "maxSmoothAngle")


def trial() -> Iterator[str]:
    """Yield the ratio of the means in each channel, with their standard errors. It needs `pip install mitsuba`."""
    for name in filter(None, os.environ.get("CLRT_MITSUBA_SCENES", "").split(":")):
        try:
            yield compared(Path(name))
        except RuntimeError as error:  # of Mitsuba's parser
            yield f"{name}: Mitsuba does not read it: {error}"


def compared(path: Path) -> str:
    """Return the line of a scene."""
    mitsuba: Any = import_module("mitsuba")
    mitsuba.set_variant("scalar_rgb")
    tree, replaced = ElementTree.parse(path), set[str]()
    _modernize(tree.getroot(), replaced)
    copy = path.with_name(f"{path.stem}_for_both.xml")
    tree.write(copy)
    try:
        scene = load(copy)
    except SceneError:
        scene = load(copy, approximate=True)
        replaced.add("--approximate")
    scale = LONGEST / max(scene.render.size)
    size = round(scene.render.size[0] * scale), round(scene.render.size[1] * scale)
    theirs = mitsuba.load_file(str(copy))
    kind = "path" if next(tree.iter("medium"), None) is None else "volpath"
    integrator = mitsuba.load_dict({"type": kind, "max_depth": DEPTH, "rr_depth": 1000})
    sensor = theirs.sensors()[0]
    film = mitsuba.traverse(sensor)
    film["film.size"] = [*size]
    film.update()
    means = np.empty((2, SEEDS, 3))
    for seed in range(SEEDS):
        picture = mitsuba.render(theirs, sensor=sensor, integrator=integrator, spp=SPP, seed=seed)
        means[0, seed] = np.array(picture)[..., :3].mean((0, 1))
        means[1, seed] = render(scene, size=size, spp=SPP, max_depth=DEPTH, seed=seed, integrator="path").pixels.mean(
            (0, 1)
        )
    own = means.mean(1)
    errors = means.std(1, ddof=1) / np.sqrt(SEEDS) / own
    ratios = " ".join(f"{a / b:.4f}±{hypot(*pair):.4f}" for a, b, pair in zip(own[1], own[0], errors.T))
    return f"{path.parent.name}/{path.stem:20} {size[0]}x{size[1]}  {ratios}  {', '.join(sorted(replaced))}"


def _modernize(element: ElementTree.Element, replaced: set[str]) -> None:
    """Replace what Mitsuba 3 does not read; add the replacements that change the image to `replaced`."""
    for child in [*element]:
        name, value, kind = child.get("name", ""), child.get("value", ""), child.get("type", "")
        stored = element.tag == "film" and name not in ("width", "height")
        if child.tag in ("integrator", "sampler") or stored or name in LEFT_OUT:
            element.remove(child)
        elif name == "gamma" and float(value) != 1:
            element.remove(child)
        elif name == "gamma":
            child.tag, child.attrib = "boolean", {"name": "raw", "value": "true"}
        elif child.tag in ("srgb", "rgb", "spectrum") and (child.tag == "srgb" or value.startswith("#")):
            child.tag, child.attrib["value"] = "rgb", " ".join(map(str, encoded_color(value).values))
        elif value in ("trilinear", "ewa"):
            child.set("value", "bilinear")
        elif child.tag == "lookAt":
            child.tag = "lookat"
        elif kind in LACKING:
            replaced.add(f"{kind}: {LACKING[kind]}")
            child.set("type", LACKING[kind])
            for part in [*child]:
                if part.get("name") not in ("reflectance", "diffuseReflectance", "diffuse_reflectance"):
                    child.remove(part)
                else:
                    part.set("name", "reflectance")
        elif name == "distribution" and value == "phong":
            replaced.add("phong: beckmann")
            child.set("value", "beckmann")
        _modernize(child, replaced)
