"""Reader for USD (.usd, .usda, .usdc, .usdz): the stage's meshes and instances, materials, lights and cameras.

What cannot be rendered is listed in one logged warning.
"""

from __future__ import annotations

import logging
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...file_names import printable
from ...scene.animation import ModelAnimation
from ...scene.frame_model import bounds
from ...scene.geometry.normals import Normals
from ...scene.geometry.transform import Matrix, scaling, translation
from ...scene.model import Mesh, Model, Vector
from ..archives import check_archive
from ..decoder import decode
from ..far_origin import far_center
from ..model_choice import DEFAULT, ModelChoice, chosen
from ..placed_meshes import shown
from ..referenced_files import note_read
from ..up_axis import upright
from .cameras import read_cameras
from .lights import read_lights
from .materials import Materials
from .meshes import Shapes

log = logging.getLogger(__name__)
#: Name of a stage's only animation.
ANIMATION = "stage"


def read_usd(path: Path, normals: Normals = "file", choice: ModelChoice = DEFAULT) -> Model:
    """Read the stage of a USD file, in meters and with +Y up, at the time of `choice`, or the first one.

    Raises SceneError naming the file and the prim that is wrong.
    """
    with _named(path):
        for what in ("scene", "variant"):
            if (wanted := getattr(choice, what)) is not None:
                chosen(wanted, [], what)
        if choice.light_unit is not None:
            raise SceneError("light_unit: is for glTF files; leave light_unit out")
        model, ignored, animation = _posed(path, normals, choice.time)
        if choice.animation is not None:
            chosen(choice.animation, [] if animation is None else [animation.name], "animation")
    if ignored:
        log.warning("%s: ignored: %s", path, ", ".join(ignored))
    return model if choice.time is not None else replace(model, animation=animation)


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Name the file in errors."""
    try:
        with np.errstate(all="ignore"):  # values that are not finite are reported
            yield
    except SceneError as error:
        raise SceneError([f"{path}: {problem}" for problem in error.problems]) from None


def _pose(path: Path, normals: Normals, center: Vector, seconds: float) -> Model:
    with _named(path):
        return _posed(path, normals, seconds, center)[0]


def _posed(
    path: Path, normals: Normals, time: float | None, center: Vector | None = None
) -> tuple[Model, list[str], ModelAnimation | None]:
    """Return the model at a time, what is ignored, and its animation, if it has one. center: see `Model`; by default
    that of this pose."""
    arrays, facts = _content(path, time)
    for layer in facts["layers"]:
        note_read(Path(layer))
    materials = Materials(path, arrays, facts)
    shapes = Shapes(path, arrays, facts, materials, normals)
    to_scene = _to_scene(facts)
    meshes, instances = shown(_places(arrays, shapes, to_scene))
    if not meshes and not instances:
        raise SceneError("its stage contains no triangles that are visible; export a model with meshes")
    center = far_center(*bounds(meshes, instances)) if center is None else center
    if any(center):
        to_scene = translation((-center[0], -center[1], -center[2])) @ to_scene
        meshes, instances = shown(_places(arrays, shapes, to_scene))
    cameras, no_cameras = read_cameras(facts["cameras"], to_scene, np.stack(bounds(meshes, instances)).mean(axis=0))
    lights = read_lights(path, facts["lights"], materials, to_scene)
    counted = facts["ignored"] | shapes.ignored
    ignored = [f"{printable(what)} ({count})" for what, count in counted.items()]
    model = Model(
        meshes=meshes,
        instances=instances,
        cameras=cameras,
        lights=lights.lights,
        emitters=lights.emitters,
        environment=lights.environment,
        contents={"animations": [ANIMATION] if facts["seconds"] else []},
        center=center,
    )
    pose = partial(_pose, path, normals, center)
    base = replace(model, meshes=list(meshes), instances=list(instances), lights=list(lights.lights))
    animation = ModelAnimation(name=ANIMATION, seconds=facts["seconds"], base=base, pose=pose, fps=facts["fps"])
    ignored = [*ignored, *materials.ignored, *lights.ignored, *no_cameras]
    return model, ignored, animation if facts["seconds"] else None


def _content(path: Path, time: float | None) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Return what the decoder process reads."""
    if find_spec("pxr") is None:
        raise SceneError("is read by usd-core, which is not installed; pip install usd-core, or export another format")
    if path.suffix.lower() == ".usdz":
        check_archive(path, compressed=False)
    try:
        with _suffixed(path) as readable:
            return decode("usd", readable, time=time)
    except SceneError as error:
        message = " ".join(printable(str(error)).split())
        raise SceneError(f"cannot be read as USD: {message}; export it again") from None


@contextmanager
def _suffixed(path: Path) -> Iterator[Path]:
    """Provide a UTF-8 path with the same suffix, which says what the format is; for a name that is not UTF-8 a link."""
    if printable(str(path)) == str(path):
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="clrt-") as folder:
        link = Path(folder) / f"stage{path.suffix.lower()}"
        link.symlink_to(path.absolute())
        yield link


def _to_scene(facts: dict[str, Any]) -> Matrix:
    """Return the matrix from the stage's axes and unit to +Y up and meters."""
    meters = float(facts["meters"])
    if not (np.isfinite(meters) and meters > 0):
        raise SceneError(f"metersPerUnit is {meters:g}; write a positive number")
    return upright("z" if facts["up"] == "Z" else "y") @ scaling((meters, meters, meters))


def _places(arrays: dict[str, NDArray[Any]], shapes: Shapes, to_scene: Matrix) -> Iterator[tuple[Mesh, Matrix]]:
    for number, matrix in zip(arrays["numbers"].tolist(), to_scene @ arrays["matrices"]):
        for mesh in shapes.meshes(number):
            yield mesh, matrix
