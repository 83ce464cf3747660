"""Scene files of pbrt for the tests."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import clrt
from clrt.errors import SceneError
from clrt.formats.load_scene import load
from clrt.scene.model import Scene

TRIANGLE = 'Shape "trianglemesh" "point3 P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1 2]'


#: A camera that mirrors, so that coordinates are those of the file.
UPRIGHT = 'Scale -1 1 1 Camera "perspective"\n'


def scene(folder: Path, world: str, before: str = UPRIGHT, approximate: bool = False) -> Scene:
    """The scene in a file of these directives."""
    path = folder / "scene.pbrt"
    path.write_text(f"{before}\nWorldBegin\n{world}\n")
    return load(path, approximate=approximate)


def problem(folder: Path, world: str, before: str = UPRIGHT) -> str:
    """What is said of such a file."""
    with pytest.raises(SceneError) as error:
        scene(folder, world, before)
    return str(error.value)


def material(folder: Path, directive: str) -> Any:
    return scene(folder, f"{directive}\n{TRIANGLE}").meshes[0].material


PLANE = """Material "diffuse" "rgb reflectance" [{0} {0} {0}]
Shape "bilinearmesh" "point3 P" [-50 0 -50  50 0 -50  -50 0 50  50 0 50]
"""


DOWN = """Film "rgb" "integer xresolution" 1 "integer yresolution" 1 {}
LookAt 0 1 0  0 0 0  0 0 1
Camera "orthographic" "float screenwindow" [-.001 .001 -.001 .001]
"""


def radiance(folder: Path, light: str, film: str = "", spp: int = 256) -> Any:
    """What is seen of a diffuse plane of reflectance .5 at the origin, lit by a light."""
    return clrt.render(scene(folder, f"{light}\n{PLANE.format(0.5)}", DOWN.format(film)), spp=spp).pixels[0, 0]
