"""Scene validation, for scenes read from files and built in Python alike."""

from __future__ import annotations

from dataclasses import fields
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError, UsageError
from ..animation import Animation, ModelAnimation, SceneAnimation
from ..camera_path import animation_problems
from ..cameras import CALIBRATED
from ..geometry.instancing import painted
from ..light_groups import name_problems
from ..light_images import LightImage
from ..lights import LIGHTS, Light
from ..materials.material_types import MATERIALS, Diffuse, Material
from ..model import Backdrop, Camera, Environment, FloatArray, Instance, Mesh, RenderSettings, Scene, Sphere
from .field_types import field_problems, show
from .instance_problems import matrix_problems

#: Per-vertex arrays that a mesh may have, and their numbers of components.
CORNERS = {"normals": (3,), "uv": (2,), "uv1": (2,), "colors": (3, 4), "tangents": (4,)}


def check_is_scene(scene: object) -> None:
    """Raise UsageError unless it is a Scene."""
    if isinstance(scene, (str, PathLike)):
        raise UsageError(f"scene is the path {str(scene)!r}; read it with clrt.load")
    if not isinstance(scene, Scene):
        raise UsageError(f"scene is a {type(scene).__name__}; give a clrt.Scene")


def validate(scene: Scene) -> None:
    """Raise one SceneError with all problems of the scene; do nothing if there are none.

    Checks the limits in the field types, the meshes' arrays (`mesh_problems`), the instances' matrices, the camera's
    frame, the environment map and the lights' directions.
    """
    problems = scene_problems(scene)
    if problems:
        raise SceneError(problems)


def scene_problems(scene: Scene) -> list[str]:
    """Return one sentence per problem; empty if the scene can be rendered."""
    if problems := _list_problems(scene):
        return problems
    problems = _camera_problems(scene.camera)
    animation = scene.animation.camera if isinstance(scene.animation, SceneAnimation) else scene.animation
    if animation is not None and not isinstance(animation, ModelAnimation):
        problems += _object_problems(animation, Animation, "animation") or (
            [] if problems else animation_problems(scene.camera, animation)
        )
    problems += _image_problems(scene.environment, Environment, "environment")
    problems += _group_problems(scene.environment, "environment")
    problems += [] if scene.backdrop is None else _image_problems(scene.backdrop, Backdrop, "backdrop")
    problems += _object_problems(scene.render, RenderSettings, "render") or _raster_problems(scene)
    problems += _local_problems(scene)
    users: list[tuple[str, Mesh | Sphere | Instance]] = []
    of_mesh: dict[int, list[str]] = {}  # by its id
    for i, mesh in enumerate(scene.meshes):
        where = f"mesh[{i}]"
        problems += of_mesh.setdefault(id(mesh), mesh_problems(mesh, where)) or texture_problems(mesh, where)
        users.append((f"mesh[{i}].material", mesh))
    for i, sphere in enumerate(scene.spheres):
        problems += _object_problems(sphere, Sphere, f"sphere[{i}]")
        users.append((f"sphere[{i}].material", sphere))
    problems += _instance_problems(scene.instances, of_mesh)
    users += [
        (f"instance[{i}].material", instance)
        for i, instance in enumerate(scene.instances)
        if getattr(instance, "material", None) is not None
    ]
    problems += _material_problems(users)
    for i, light in enumerate(scene.lights):
        problems += _light_problems(light, f"light[{i}]")
    return problems


def _list_problems(scene: Scene) -> list[str]:
    """Return problems of parts of the scene that should be lists and are not."""
    parts = {name: getattr(scene, name) for name in ("meshes", "instances", "spheres", "lights")}
    return [
        f"{name}: {show(part)} is not a list; write {name}=[...]"
        for name, part in parts.items()
        if not isinstance(part, (list, tuple))
    ]


def mesh_problems(mesh: object, where: str) -> list[str]:
    """Return what is wrong with a mesh's arrays.

    Rejected: other shapes or dtypes than those of `Mesh`, no triangles, values that are not finite (used by a face or
    not), indices out of range, normals of length zero, and colors outside 0 to 1.
    """
    if not isinstance(mesh, Mesh):
        return [f"{where}: {show(mesh)} is not a Mesh; write a clrt.Mesh"]
    where += f" {show(mesh.name)}"
    n = len(mesh.vertices) if isinstance(mesh.vertices, np.ndarray) else 0
    arrays: list[tuple[str, object, type, str, tuple[int, ...]]] = [
        ("vertices", mesh.vertices, np.float32, "n", (3,)),
        ("faces", mesh.faces, np.int32, "m", (3,)),
    ]
    corners = {name: array for name in CORNERS if (array := getattr(mesh, name)) is not None}
    arrays += [(name, array, np.float32, str(n), CORNERS[name]) for name, array in corners.items()]
    problems = [
        problem
        for name, array, dtype, rows, columns in arrays
        if (problem := _array_problem(array, dtype, rows, columns, f"{where}: {name}"))
    ]
    if problems:
        wide = isinstance(mesh.faces, np.ndarray) and mesh.faces.dtype in (np.int64, np.uint64, np.uint32)
        return wide and index_problems(mesh.faces, n, where) or problems
    if len(mesh.faces) == 0:
        problems.append(f"{where}: has no triangles; add some or leave the mesh out")
    problems += index_problems(mesh.faces, n, where)
    problems += _row_problems(_not_finite(mesh.vertices), mesh.vertices, f"{where}: vertices", "is not finite")
    for name, array in corners.items():
        bad, fault = _not_finite(array), "is not finite"
        if name == "normals":
            bad, fault = bad | ~np.any(array, axis=1), "points nowhere"
        elif name == "colors":
            bad, fault = bad | np.any((array < 0) | (array > 1), axis=1), "is not a colour from 0 to 1"
        problems += _row_problems(bad, array, f"{where}: {name}", fault)
    return problems


def texture_problems(mesh: Mesh, where: str) -> list[str]:
    """Return problems of textures for which the mesh has no texture coordinates."""
    material: object = mesh.material
    textures = material.textures() if isinstance(material, Material) else []
    return [
        f"{where} {show(mesh.name)}: its material reads the texture {show(texture.picture.name)} at uv"
        f"{texture.uv_set or ''}, but the mesh has none; add texture coordinates, or use another material"
        for texture in textures
        if (mesh.uv1 if texture.uv_set else mesh.uv) is None
    ]


def index_problems(faces: NDArray[np.integer], n: int, where: str) -> list[str]:
    """Return the first index, of any integer dtype, outside 0 … n − 1, and the number of others."""
    if len(faces) == 0 or (faces.min() >= 0 and faces.max() < n):
        return []
    bad = np.asarray(((faces < 0) | (faces >= n)).any(axis=1))
    face = int(bad.argmax())
    vertex = next(index for index in faces[face].tolist() if not 0 <= index < n)
    valid = f"valid indices are 0 to {n - 1}" if n else "the mesh has no vertices"
    return [f"{where}: faces[{face}] uses vertex {vertex}, but {valid}{_others(bad)}; repair the mesh"]


def _array_problem(array: object, dtype: type, rows: str, columns: tuple[int, ...], where: str) -> str | None:
    """Return a problem unless `array` is a (rows, k) array of `dtype`, with k one of `columns`."""
    name, shape = np.dtype(dtype).name, " or ".join(f"({rows}, {k})" for k in columns)
    if not isinstance(array, np.ndarray):
        return f"{where} is a {type(array).__name__}; write a numpy array of {name}, shape {shape}"
    if array.dtype != dtype:
        return f"{where} has dtype {array.dtype}; convert it with .astype(np.{name})"
    if array.ndim != 2 or array.shape[1] not in columns or (rows.isdigit() and len(array) != int(rows)):
        return f"{where} has shape {array.shape}; it must be {shape}"
    return None


def _row_problems(bad: NDArray[np.bool_], array: FloatArray, where: str, fault: str) -> list[str]:
    """Return a problem for the first bad row, with the number of others."""
    if not bad.any():
        return []
    row = int(bad.argmax())
    return [f"{where}[{row}] = {_row(array[row])} {fault}{_others(bad)}; repair the mesh"]


def _not_finite(rows: FloatArray) -> NDArray[np.bool_]:
    finite = np.ones(len(rows), np.bool_)
    for column in np.isfinite(rows).T:  # all(axis=1) takes seven times as long
        finite &= column
    return ~finite


def _row(values: FloatArray) -> str:
    return show(tuple(float(f"{value:.6g}") for value in values))


def _others(rows: NDArray[np.bool_]) -> str:
    count = int(rows.sum()) - 1
    return f" (and {count} more)" if count else ""


def _object_problems(value: object, kind: type, where: str) -> list[str]:
    """Return problems unless `value` is a `kind` whose fields are within their limits."""
    if not isinstance(value, kind):
        names = [each.__name__ for each in MATERIALS] if kind is Material else [kind.__name__]
        return [f"{where}: {show(value)} is not of type {kind.__name__}; write a clrt.{' or clrt.'.join(names)}"]
    values = {field.name: getattr(value, field.name) for field in fields(type(value))}  # type: ignore[arg-type]
    return field_problems(type(value), values, where)


def _instance_problems(instances: list[Instance], of_mesh: dict[int, list[str]]) -> list[str]:
    """Return problems of instances and of the meshes that only they show; of_mesh: problems of other meshes, by id."""
    problems: list[str] = []
    placed: list[tuple[int, Instance]] = []
    seen = set()  # pairs of mesh and material
    for i, instance in enumerate(instances):
        where = f"instance[{i}]"
        wrong = _object_problems(instance, Instance, where)
        if not wrong and np.shape(instance.to_world) != (3, 4):
            wrong = [
                f"{where} {show(instance.name)}: to_world has shape {np.shape(instance.to_world)}; write a numpy "
                "array of shape (3, 4), or (4, 4) with the last row 0, 0, 0, 1"
            ]
        if isinstance(instance, Instance) and id(instance.mesh) not in of_mesh:
            wrong += of_mesh.setdefault(id(instance.mesh), mesh_problems(instance.mesh, f"{where}.mesh"))
        problems += wrong
        if wrong or of_mesh[id(instance.mesh)]:
            continue
        placed.append((i, instance))
        if (pair := (id(instance.mesh), id(instance.material))) not in seen:
            seen.add(pair)
            problems += texture_problems(painted(instance), where)
    return problems + matrix_problems(placed)


def _material_problems(users: list[tuple[str, Mesh | Sphere | Instance]]) -> list[str]:
    """Return the problems of each material, at its first use."""
    first: dict[int, tuple[str, object]] = {}
    for where, user in users:
        material = getattr(user, "material", Diffuse())
        first.setdefault(id(material), (where, material))
    problems: list[str] = []
    for where, material in first.values():
        found = _object_problems(material, Material, where)
        if isinstance(material, Material) and not found:
            found = [f"{where}.{conflict}" for conflict in material.conflicts()] + _catcher_problems(material, where)
            found += _group_problems(material, where)
        problems += found
    return problems


def _group_problems(emitter: Material | Light | Environment, where: str) -> list[str]:
    """Return a problem if layers cannot have the name of its light group."""
    name: object = emitter.light_group  # of another type it is a problem already
    return name_problems(name, f"{where}.light_group") if isinstance(name, str) else []


def _catcher_problems(material: Material, where: str) -> list[str]:
    """Return a problem if a catcher emits, or if the camera cannot see it."""
    if not material.catcher:
        return []
    if any(material.radiance):
        return [f"{where}.catcher: a catcher shows light that it receives, and this one emits; leave out one of them"]
    if not material.camera_visible:
        return [f"{where}.catcher: a catcher must be seen by the camera; leave out camera_visible = false"]
    return []


def _camera_problems(camera: Camera) -> list[str]:
    """Return problems of the camera's fields, and of a degenerate frame."""
    problems = _object_problems(camera, Camera, "camera")
    if problems:
        return problems
    forward, up = np.subtract(camera.look_at, camera.position), np.array(camera.up, np.float64)
    if not forward.any():
        return [f"camera.look_at: {show(camera.look_at)} is the camera's own position; move one of them"]
    if not up.any():
        return ["camera.up: [0, 0, 0] is not a direction; write one, such as [0, 1, 0]"]
    right = np.cross(forward / np.abs(forward).max(), up / np.abs(up).max())
    if np.linalg.norm(right) < 1e-6:
        return [f"camera.up: {show(camera.up)} is parallel to the view direction; write another, such as [0, 0, -1]"]
    if (counts := CALIBRATED.get(camera.projection)) and len(camera.distortion) not in (0, *counts):
        order = "k1, k2, p1, p2, k3, k4, k5, k6" if max(counts) == 8 else "k1, k2, k3, k4"
        return [
            f"camera.distortion: {show(camera.distortion)} has {len(camera.distortion)} entries; write "
            f'{" or ".join(map(str, counts))} with projection = "{camera.projection}": {order}'
        ]
    return [
        f'camera.{name}: {show(getattr(camera, name))} has no effect with projection = "{camera.projection}"; '
        "leave it out"
        for name, default in camera.unread_fields().items()
        if getattr(camera, name) != default
    ]


def _raster_problems(scene: Scene) -> list[str]:
    """Return a problem if the raster integrator does not support the camera."""
    camera, plain = scene.camera, Camera()
    if scene.render.integrator != "raster":
        return []
    names = ("projection", "aperture_radius", "lens_shift", "skew", "distortion")
    given = next((name for name in names if getattr(camera, name) != getattr(plain, name)), None)
    if given is None:
        return []
    shown = f"{given} = {show(getattr(camera, given))}"
    return [
        f'render.integrator: "raster" supports only pinhole cameras, and the camera has {shown}; leave that out, '
        'or write "local"'
    ]


def _local_problems(scene: Scene) -> list[str]:
    """Return a problem if a local integrator is to render catchers."""
    integrator = getattr(scene.render, "integrator", None)
    parts = [
        *scene.meshes,
        *scene.spheres,
        *scene.instances,
        *(getattr(each, "mesh", None) for each in scene.instances),
    ]
    caught = any(getattr(getattr(part, "material", None), "catcher", False) for part in parts)
    if integrator not in ("local", "raster") or not caught:
        return []
    return [
        f'render.integrator: "{integrator}" does not support catchers, which need light with and without the objects; '
        'write "path" or "direct", or leave out catcher = true'
    ]


def _image_problems(value: Environment | Backdrop, wanted: type, where: str) -> list[str]:
    """Return problems of an object with a color or an image."""
    problems = _object_problems(value, wanted, where)
    if problems or value.image is None:
        return problems
    return _pixel_problems(value.image, f"{where}.image")


def _pixel_problems(image: object, where: str) -> list[str]:
    """Return problems unless it is an array (h, w, 3) of float32, finite and at least 0."""
    if not isinstance(image, np.ndarray) or image.dtype != np.float32:
        kind = image.dtype if isinstance(image, np.ndarray) else type(image).__name__
        return [f"{where}: is {kind}; write a numpy array of float32"]
    if image.ndim != 3 or image.shape[2] != 3 or 0 in image.shape:
        return [f"{where}: has shape {image.shape}; it must be (height, width, 3) with at least one pixel"]
    problems = []
    for bad, fault in ((~np.isfinite(image), "not finite"), (image < 0, "negative")):
        if bad.any():
            pixels = bad.any(axis=2)
            row, column = np.argwhere(pixels)[0]
            problems.append(
                f"{where}: {np.count_nonzero(pixels)} pixels are {fault}, the first in row {row}, "
                f"column {column}: {_row(image[row, column])}; repair the image"
            )
    return problems


def _light_problems(light: object, where: str) -> list[str]:
    if not isinstance(light, LIGHTS):
        return [f"{where}: {show(light)} is not a light; write a {' or '.join(kind.__name__ for kind in LIGHTS)}"]
    problems = _object_problems(light, type(light), where) + _shown_problems(getattr(light, "image", None), where)
    return problems or [f"{where}.{conflict}" for conflict in light.conflicts()] + _group_problems(light, where)


def _shown_problems(image: object, where: str) -> list[str]:
    """Return the problems of a light's image."""
    if image is None:
        return []
    problems = _object_problems(image, LightImage, f"{where}.image")
    return problems if not isinstance(image, LightImage) else problems + _pixel_problems(image.pixels, f"{where}.image")
