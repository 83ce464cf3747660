"""Scene loading: a TOML scene file, a Mitsuba or pbrt scene, or a bare model with a default camera and sky."""

from __future__ import annotations

import logging
import sys
import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from itertools import chain
from os import PathLike
from pathlib import Path
from typing import Any, get_args

from ..errors import SceneError, UsageError, check_choice
from ..file_names import StrPath
from ..scene.axes_and_units import CONVERTED, Axis, Unit
from ..scene.fields.field_types import field_problems
from ..scene.frame_model import VIEWS, frame
from ..scene.geometry.transform import rotation, translation
from ..scene.model import Framing, Instance, Mesh, Model, RenderSettings, Scene
from ..scene.model_pose import with_poses
from ..scene.provenance import source_of_model
from ..scene.validation.validate import scene_problems
from .model_choice import DEFAULT, ModelChoice
from .model_look import Look, default_look, look_of
from .models import SUFFIXES, read_model
from .referenced_files import check_file, name_of
from .toml.instance_table import placed
from .toml.mesh_table import MeshTable
from .toml.reader import SceneReader, camera_problems
from .up_axis import upright

log = logging.getLogger(__name__)
#: Stands for a TOML scene on standard input; its file names are relative to the working directory.
STDIN = Path("-")
#: Number of poses of an animation that the camera of a bare model frames.
POSES = 17


def load(
    path: StrPath,
    camera: str | None = None,
    up: Axis | None = None,
    unit: Unit | None = None,
    choice: ModelChoice = DEFAULT,
    moving: bool = False,
    approximate: bool = False,
    parameters: Mapping[str, str] = {},
    look: Look | None = None,
    size: tuple[int, int] | None = None,
) -> Scene:
    """Load a scene from a .toml file, a Mitsuba .xml or pbrt .pbrt file, a model file (whose meshes get light, a ground
    and a camera), or from standard input for "-".

    A glTF model's first camera and its lights are used if it has any. camera: name of another camera to use, of a scene
    or a model file, or for a model one of VIEWS. up, unit: of a model file, if they are not as it or its format says;
    choice: for bare models; moving: whether a camera that frames a model frames its animation, as it does if one is
    chosen; approximate: of a Mitsuba or pbrt scene, whether what clrt lacks is replaced or left out, with warnings;
    parameters: of a Mitsuba scene, values of $NAME; look: of a bare model, by default that of `default_look`; size: of
    the images, which a model's camera frames it in. Raises one SceneError with all problems of the file, each as
    "FILE: object: value is wrong; remedy".
    """
    if not isinstance(path, (str, PathLike)):
        raise SceneError(f'{path!r} is not the path of a scene; give a file name, such as "scene.toml"')
    for name, value, known in (("up", up, Axis), ("unit", unit, Unit), ("look", look, Look)):
        check_choice(name, value, (None, *get_args(known)))
    _check_types(camera, approximate, parameters, size)
    path = Path(path)
    check_scene(path)
    reader = _load_toml if path == STDIN else _READERS.get(_suffix(path))
    if approximate and _suffix(path) not in _APPROXIMATING:
        raise UsageError(f"{path}: approximate is for Mitsuba's and pbrt's scenes; leave it out")
    if parameters and reader is not _load_mitsuba:
        raise UsageError(f"{path}: -D {next(iter(parameters))}: parameters are for Mitsuba's scenes; leave them out")
    if reader:
        _check_not_of_models(path, up, unit, look, choice)
    if approximate:
        reader = partial(_APPROXIMATING[_suffix(path)], approximate=True)
    if parameters:
        reader = partial(_load_mitsuba, approximate=approximate, parameters=parameters)
    with _named(path):
        scene, problems = (
            reader(path) if reader else (_load_model(path, camera, up, unit, choice, moving, look, size), [])
        )
    if size is not None:
        scene.render = replace(scene.render, size=size)
    views = [] if reader else [name for name in VIEWS if name not in scene.cameras]
    if camera is not None and camera not in views:
        scene.camera = scene.cameras.get(camera, scene.camera)
        problems += camera_problems(camera, [*scene.cameras, *views], "--camera")
    problems += scene_problems(scene)
    if problems:
        raise SceneError([f"{path}: {problem}" for problem in problems])
    return scene


def _check_not_of_models(path: Path, up: object, unit: object, look: object, choice: ModelChoice) -> None:
    """Raise UsageError if a scene file is given arguments for models."""
    if up or unit:
        raise UsageError(f'{path}: up and unit are for model files; in a scene file, write up = "z" in a [[mesh]]')
    if look:
        raise UsageError(f"{path}: look is for model files; a scene file has lights of its own, so leave look out")
    if choice != DEFAULT:
        raise UsageError(f"{path}: {choice.given()[0]}: is for bare models; leave {choice.given()[0]} out")


def _check_types(camera: object, approximate: object, parameters: object, size: object) -> None:
    """Raise UsageError unless these arguments of `load` are of their types."""
    if not isinstance(camera, str | None):
        raise UsageError(f"camera {camera!r} is not a name")
    if size is not None and (problems := field_problems(RenderSettings, {"size": size}, "load")):
        raise UsageError("\n".join(problems))
    if not isinstance(approximate, bool):
        raise UsageError(f"approximate {approximate!r} is not a boolean")
    if not isinstance(parameters, Mapping) or not all(isinstance(each, str) for each in chain(*parameters.items())):
        raise UsageError(f'parameters {parameters!r} do not map names to strings; write {{"NAME": "VALUE"}}')


def check_scene(path: Path) -> None:
    """Raise SceneError unless `path` is STDIN or an existing file with the suffix of a scene or a model."""
    if path == STDIN:
        return
    is_model = path.suffix.lower() in SUFFIXES
    check_file(path, "model" if is_model else "scene")
    if not is_model and _suffix(path) not in _READERS:
        raise SceneError(f"{path}: a scene must be one of {', '.join((*_READERS, *SUFFIXES))}; convert it")


def _load_model(
    path: Path,
    view: str | None,
    up: Axis | None,
    unit: Unit | None,
    choice: ModelChoice,
    moving: bool,
    look: Look | None,
    size: tuple[int, int] | None,
) -> Scene:
    """Load a bare model with its own lights or those of the look, and its first camera or one that frames it.

    view: one of VIEWS replaces the model's cameras, except one of that name, as another name chooses one. up, unit:
    those of the file if None; choice, moving, look, size: see `load`.
    """
    model = read_model(path, choice=choice)
    placing: dict[str, Any] = {"up": up or model.up, "unit": unit or model.unit}
    placing = {key: value for key, value in placing.items() if value != getattr(MeshTable, key)}
    matrix = upright(up or model.up, unit or model.unit)
    if any(model.center):
        placing["translate"] = tuple((-matrix[:3, :3] @ model.center).tolist())
        x, y, z = placing["translate"]
        matrix = translation((x, y, z)) @ matrix
        log.warning("%s: is far from the origin; it is moved there, by (%.9g, %.9g, %.9g)", path, x, y, z)
    if placing:
        model = with_poses(model, partial(placed, matrix=matrix, material=None, others={}))
    if model.converted_from is not None:
        log.warning(
            "%s: %s; --light-unit radiometric takes them as W/sr and W/m²", path, CONVERTED[model.converted_from]
        )
    angle = None if view is None or view in model.cameras else VIEWS.get(view)
    width, height = size or RenderSettings.size
    framed = _framed(model, moving or choice.animation is not None)
    camera = model.cameras.get(view or next(iter(model.cameras), "")) if angle is None else None
    framing = None
    if camera is None:
        camera = frame(*framed, rotation((0.0, angle or 0.0, 0.0)), width / height)
        framing = Framing(camera, model.meshes, model.instances)
    look = look or default_look(model)
    contents = {**model.contents, "look": [look]}
    source = source_of_model(
        path, replace(model, contents=contents), placing, whole=replace(choice, light_unit=None) == DEFAULT
    )
    return Scene(
        meshes=model.meshes + model.emitters,
        instances=model.instances,
        camera=camera,
        cameras=model.cameras,
        name=name_of(path),
        animation=model.animation,
        source=replace(source, framing=framing),
        **look_of(look, model, camera, angle or 0.0, framed),
    )


def _framed(model: Model, moving: bool) -> tuple[list[Mesh], list[Instance]]:
    """Return the model's meshes and instances, if `moving` at POSES times of its animation."""
    animation = model.animation
    if animation is None or not moving:
        return model.meshes, model.instances
    poses = [animation.pose(animation.seconds * i / (POSES - 1)) for i in range(POSES)]
    return [mesh for pose in poses for mesh in pose.meshes], [each for pose in poses for each in pose.instances]


def _load_toml(path: Path) -> tuple[Scene, list[str]]:
    """Load a TOML scene, and return it with the problems of its file."""
    try:
        content = sys.stdin.buffer.read() if path == STDIN else path.read_bytes()
        document = tomllib.loads(content.decode())
    except (ValueError, RecursionError) as error:  # also for invalid UTF-8 and for numbers of 4300 digits
        raise SceneError(f"{path}: is not valid TOML: {error}") from None
    reader = SceneReader(path, document)
    scene = reader.scene()
    return scene, reader.problems


def _load_mitsuba(path: Path, approximate: bool = False, parameters: Mapping[str, str] = {}) -> tuple[Scene, list[str]]:
    """Load a Mitsuba scene, logging a warning per model that only approximates Mitsuba's."""
    from .mitsuba.reader import read_mitsuba

    return _warned(path, lambda: read_mitsuba(path, approximate=approximate, parameters=parameters)[:2])


def _load_pbrt(path: Path, approximate: bool = False) -> tuple[Scene, list[str]]:
    """Load a pbrt scene, logging a warning per model that only approximates pbrt's."""
    from .pbrt.reader import read_pbrt

    return _warned(path, lambda: read_pbrt(path, approximate))


def _warned(path: Path, read: Callable[[], tuple[Scene, list[str]]]) -> tuple[Scene, list[str]]:
    """Return the scene of a reader, and log the differences that it returns."""
    scene, differences = read()
    for difference in differences:
        log.warning("%s: %s", path, difference)
    return scene, []


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Name the file in problems that do not."""
    try:
        yield
    except SceneError as error:
        start = f"{path}: "
        raise SceneError(
            [problem if problem.startswith(start) else f"{start}{problem}" for problem in error.problems]
        ) from None


def _suffix(path: Path) -> str:
    """Return the suffix in lower case, with that before .gz."""
    ends = [suffix.lower() for suffix in path.suffixes[-2:]]
    return "".join(ends if ends[1:] == [".gz"] else ends[-1:])


#: Readers that may replace what clrt lacks, and all readers of scene files, by suffix; those of models are in
#: models.FORMATS.
_APPROXIMATING = {".xml": _load_mitsuba, ".pbrt": _load_pbrt, ".pbrt.gz": _load_pbrt}
_READERS = {".toml": _load_toml, **_APPROXIMATING}
