"""Public functions take file names as str or os.PathLike."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clrt
from clrt.output.scenes import save_scene

SCENE = """
[render]
size = [8, 8]
spp = 1
[environment]
color = [1, 1, 1]
[[sphere]]
"""
#: Type hints that include a file name; `AnyImage` is compare's.
FILE_NAME = re.compile(r"StrPath|PathLike|^AnyImage$")


class Named:
    """A file name that is neither str nor Path."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __fspath__(self) -> str:
        return str(self.path)


def public() -> Iterator[tuple[str, Callable[..., Any]]]:
    """Yield the package's functions and its classes' methods and constructors, and what the documentation names."""
    for name in clrt.__all__:
        value = getattr(clrt, name)
        if inspect.isfunction(value):
            yield name, value
        elif inspect.isclass(value):
            methods = ((method, part) for method, part in vars(value).items() if not method.startswith("_"))
            yield from ((f"{name}.{method}", part) for method, part in methods if inspect.isfunction(part))
            yield from [(name, value.__init__)] if inspect.isfunction(value.__init__) else []
    yield "save_scene", save_scene


#: Each parameter that takes a file name, with a call that uses it on a scene, an image, or a new file.
CALLS: dict[str, Callable[[Any], Any]] = {
    "load path": lambda scene: clrt.load(scene),
    "render scene": lambda scene: clrt.render(scene),
    "animate scene": lambda scene: next(clrt.animate(scene, frames=[0])),
    "read_image path": lambda image: clrt.read_image(image),
    "compare image": lambda image: clrt.compare(image, np.ones((8, 8, 3), np.float32)),
    "compare reference": lambda image: clrt.compare(np.ones((8, 8, 3), np.float32), image),
    "render checkpoint": lambda new_ck: clrt.render(clrt.Scene(), spp=1, size=(8, 8), checkpoint=new_ck),
    "relight image": lambda new_exr: (
        clrt.render(clrt.Scene(spheres=[clrt.Sphere()]), spp=1, size=(8, 8), aovs="light_groups").save(new_exr)
        or clrt.relight(new_exr, {})
    ),
    "Image.save path": lambda new_png: clrt.Image(np.ones((8, 8, 3), np.float32)).save(new_png),
    "Renderer checkpoint": lambda new_ck: list(
        clrt.Renderer(clrt.Scene(spheres=[clrt.Sphere()]), spp=1, size=(8, 8), checkpoint=new_ck).passes()
    ),
    "LightMap.save path": lambda new_png: clrt.LightMap(
        np.ones((8, 8, 3), np.float32), np.zeros((8, 8, 3), np.float32), np.ones((8, 8), bool), {"what": "occlusion"}
    ).save(new_png),
    "save_views folder": lambda new: clrt.save_views(
        new, clrt.Scene(), clrt.each_view(clrt.Scene(), [clrt.Camera()], "depth", size=(8, 8))
    ),
    "save_scene path": lambda new_toml: save_scene(clrt.Scene(spheres=[clrt.Sphere()]), new_toml),
}


def test_each_parameter_with_a_file_name_is_called_below() -> None:
    hints = {
        f"{name} {each.name}": str(each.annotation)
        for name, function in public()
        for each in inspect.signature(function).parameters.values()
    }
    assert [each for each, hint in hints.items() if re.search(r"\bPath\b", hint)] == []
    named = {each for each, hint in hints.items() if FILE_NAME.search(hint)}
    assert named - {"Texture picture", "animate checkpoint"} == set(CALLS)  # an animation's checkpoint is refused


@pytest.mark.parametrize("form", [str, Path, Named])
@pytest.mark.parametrize("parameter", CALLS)
def test_file_names_may_be_text_or_path_like(parameter: str, form: type, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(SCENE + "[animation]\nturntable_seconds = 1\n")
    clrt.Image(np.ones((8, 8, 3), np.float32)).save(tmp_path / "a.exr")
    call = CALLS[parameter]
    (kind,) = inspect.signature(call).parameters
    name = {"scene": "a.toml", "image": "a.exr"}.get(kind, kind.replace("_", "."))
    file = tmp_path / name
    call(form(file))
    assert file.exists()
