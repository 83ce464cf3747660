"""Other programs that pose an animated glTF file: Blender (`pip install bpy`) and VTK (`pip install vtk`).

Each returns the vertices that a file's triangles have at some times of one of its animations.
"""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Callable, Iterable, Iterator, Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import UsageError
from ...formats.gltf.accessors import split_glb
from .cycles_renderer import quiet

Doubles = NDArray[np.float64]
#: A file, the number of one of its animations, and times in seconds, to the posed vertices (n, 3) at each time.
Poser = Callable[[Path, int, Sequence[float]], Iterator[Doubles]]
#: Blender's frames per second: keyframes lie on whole and fractional frames, which are float32.
FPS = 1000


def peers() -> dict[str, Poser]:
    """Return the programs that are installed. Raises UsageError if none is, or if scipy is not."""
    found = {}
    for name, (module, poser) in POSERS.items():
        try:
            import_module(module)
        except ImportError:
            continue
        found[name] = poser
    if not found or find_spec("scipy") is None:
        raise UsageError("Blender, VTK or scipy is not installed; run pip install scipy, and bpy (Python 3.11) or vtk")
    return found


def _blender_poses(path: Path, animation: int, times: Sequence[float]) -> Iterator[Doubles]:
    """Yield the vertices of Blender's evaluated meshes.

    The importer turns CUBICSPLINE into Bézier curves without the file's tangents, and rotations into quaternions whose
    components are interpolated, so that its poses are the file's at keyframes alone.
    """
    library = import_module("bpy")
    library.ops.wm.read_factory_settings(use_empty=True)
    scene = library.context.scene
    scene.render.fps, scene.render.fps_base = FPS, 1.0
    with TemporaryDirectory() as folder:
        alone = _with_one_animation(path, animation, Path(folder))
        try:
            with quiet():
                library.ops.import_scene.gltf(filepath=str(alone), disable_bone_shape=True)
        except RuntimeError as error:
            raise UsageError(f"{path}: Blender does not read it: {' '.join(str(error).split())}") from None
    for key in [key for keys in library.data.shape_keys for key in keys.key_blocks]:
        key.slider_min, key.slider_max = -10.0, 10.0  # weights are clamped to these
    for time in times:
        frame = int(time * FPS)
        scene.frame_set(frame, subframe=time * FPS - frame)
        yield _joined(path, _evaluated(library.context.evaluated_depsgraph_get()))


def _with_one_animation(path: Path, animation: int, folder: Path) -> Path:
    """Write the file with this animation alone; in Blender, what another one moved would keep its pose."""
    content = path.read_bytes()
    text, chunk = split_glb(content) if content.startswith(b"glTF") else (content, None)
    document = json.loads(text)
    document["animations"] = [document["animations"][animation]]
    for each in (*document["buffers"], *document.get("images", ())):
        if not each.get("uri", "data:").startswith("data:"):
            each["uri"] = str(path.parent.absolute() / each["uri"])
    if chunk is not None:
        document["buffers"][0]["uri"] = "data:application/octet-stream;base64," + b64encode(bytes(chunk)).decode()
    alone = folder / "alone.gltf"
    alone.write_text(json.dumps(document))
    return alone


def _evaluated(graph: Any) -> Iterator[Doubles]:
    """Yield the vertices of each object and instance, with +Y up as in glTF."""
    for instance in graph.object_instances:
        if instance.object.type == "MESH":
            mesh = instance.object.to_mesh()
            points = np.empty(3 * len(mesh.vertices), np.float32)
            mesh.vertices.foreach_get("co", points)
            instance.object.to_mesh_clear()
            to_world = np.array(instance.matrix_world)
            x, y, z = to_world[:3, :3] @ points.reshape(-1, 3).T + to_world[:3, 3:]
            yield np.column_stack([x, z, -y])


def _vtk_poses(path: Path, animation: int, times: Sequence[float]) -> Iterator[Doubles]:
    """Yield the vertices of VTK's deformed meshes, each with a reader of its own: a second pose loses morph targets."""
    library = import_module("vtk")
    arrays = import_module("vtk.util.numpy_support")
    library.vtkObject.GlobalWarningDisplayOff()
    for time in times:
        reader = library.vtkGLTFReader()
        reader.SetFileName(str(path))
        reader.ApplyDeformationsToGeometryOn()
        reader.UpdateInformation()
        reader.EnableAnimation(animation)
        reader.UpdateTimeStep(time)
        leaves = reader.GetOutputDataObject(0).NewTreeIterator()
        points = []
        leaves.InitTraversal()
        while not leaves.IsDoneWithTraversal():
            points.append(arrays.vtk_to_numpy(leaves.GetCurrentDataObject().GetPoints().GetData()).astype(np.float64))
            leaves.GoToNextItem()
        yield _joined(path, points)


def _joined(path: Path, parts: Iterable[Doubles]) -> Doubles:
    """Return the vertices of all parts. Raises UsageError if there are none, or some that are not finite."""
    every = np.concatenate([np.zeros((0, 3)), *parts])
    if not len(every):
        raise UsageError(f"{path}: the other program finds no vertices in it")
    if not np.isfinite(every).all():
        raise UsageError(f"{path}: the other program's vertices are not all finite")
    return every


#: Modules and functions by the program's name.
POSERS: dict[str, tuple[str, Poser]] = {"Blender": ("bpy", _blender_poses), "VTK": ("vtk", _vtk_poses)}
