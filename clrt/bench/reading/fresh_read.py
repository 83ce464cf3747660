"""Reading of a model file in a new process. `python -m clrt.bench.reading.fresh_read READER FILE` prints seconds,
processor seconds, additional peak memory and the number of triangles as JSON."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from ..process_memory import children_peak_bytes, cpu_seconds, peak_bytes, reset_peak

#: clrt's reader of each format, which is imported when a file is read.
MODULES = {
    ".obj": "wavefront.obj",
    ".ply": "ply.reader",
    ".stl": "stl",
    ".off": "off",
    ".glb": "gltf.reader",
    ".usdc": "usd.reader",
    ".3mf": "threemf.reader",
}
#: Reads a file, and returns its number of triangles.
Read = Callable[[str], int]


def _clrt(suffix: str) -> Read:
    from ...formats.models import read_mesh

    import_module(f"clrt.formats.{MODULES[suffix]}")

    return lambda file: sum(len(mesh.faces) for mesh in read_mesh(file))


def _trimesh(_: str) -> Read:
    import trimesh

    def read(file: str) -> int:
        found: Any = trimesh.load(file, process=False)
        return sum(len(each.faces) for each in getattr(found, "geometry", {"": found}).values())

    return read


def _open3d(_: str) -> Read:
    read = import_module("open3d").io.read_triangle_mesh
    return lambda file: len(read(file).triangles)


def _blender(suffix: str) -> Read:
    library: Any = import_module("bpy")
    operators = library.ops
    operators.wm.read_factory_settings(use_empty=True)
    load = {
        ".obj": operators.wm.obj_import,
        ".ply": operators.wm.ply_import,
        ".stl": operators.wm.stl_import,
        ".glb": operators.import_scene.gltf,
        ".usdc": operators.wm.usd_import,
    }[suffix]

    def read(file: str) -> int:
        load(filepath=file)
        return sum(len(mesh.polygons) for mesh in library.data.meshes)

    return read


#: By name: import the library, and return how it reads files of this suffix, or raise KeyError if it does not.
READERS: dict[str, Callable[[str], Read]] = {
    "clrt": _clrt,
    "trimesh": _trimesh,
    "Open3D": _open3d,
    "Blender": _blender,
}


def measure(reader: str, file: str) -> dict[str, Any]:
    """Read a file in this process."""
    read = READERS[reader](Path(file).suffix)
    before, start, cpu_start = reset_peak(), time.perf_counter(), cpu_seconds()
    triangles = read(file)
    seconds, cpu, peak = time.perf_counter() - start, cpu_seconds() - cpu_start, peak_bytes()
    added = None if before is None or peak is None else peak - before + children_peak_bytes()
    return {"seconds": seconds, "cpu_seconds": cpu, "added_bytes": added, "triangles": triangles}


if __name__ == "__main__":
    print("\n" + json.dumps(measure(*sys.argv[1:])))
