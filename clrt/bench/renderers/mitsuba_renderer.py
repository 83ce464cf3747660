"""Mitsuba 3 as a contestant: `pip install mitsuba`, in its parallel LLVM variant if an LLVM library is found."""

from __future__ import annotations

import os
import re
import time
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from ...scene.model import Scene
from ..convergence.contestants import Contestant, Picture
from .mitsuba_file import from_file
from .mitsuba_scene import mitsuba_scene, path_depth

LLVM_VARIABLE = "DRJIT_LIBLLVM_PATH"
#: Samplers by suffix of the contestant's name.
SAMPLERS = {"": "independent", ", multijitter": "multijitter"}
#: Modules in mitsuba_plugins/ that register a BSDF.
PLUGINS = ("gltf_bsdf", "height_correlated", "phong_bsdf", "rough_glass_bsdf", "sheet_bsdf")
#: Older versions cannot compile Mitsuba's code, and terminate the process.
OLDEST_LLVM = 17
LLVM_FOLDERS = ("usr/lib", "usr/lib64", "usr/lib/*-linux-gnu", "usr/lib/llvm*/lib", "usr/local/lib")


def contestants(scene: Scene, file: Path | None = None) -> dict[str, Contestant]:
    """Return Mitsuba with each of SAMPLERS, which reads the scene's file itself if that is one of its own.

    Raises ImportError if it is not installed, and UsageError for unsupported scenes and files that Mitsuba refuses.
    """
    library, name = load()
    own = file if file and file.suffix.lower() == ".xml" else None
    return {
        name + suffix: Mitsuba(
            library,
            from_file(library, own, scene.render, path_depth(scene), sampler) if own else mitsuba_scene(scene, sampler),
        )
        for suffix, sampler in SAMPLERS.items()
    }


class Mitsuba:
    """Contestant that renders a scene of Mitsuba's, or the result of `mitsuba_scene`."""

    def __init__(self, library: Any, scene: Any) -> None:
        self._library, self._given = library, scene
        self._compiled: set[int] = set()

    def __call__(self, spp: int, seed: int) -> Picture:
        scene = self._scene
        if spp not in self._compiled:  # Mitsuba recompiles for every number of samples
            self._compiled.add(spp)
            self(spp, seed)
        sampler = scene.sensors()[0].sampler()
        sampler.set_sample_count(spp)  # or more: multijitter uses a grid
        start, cpu = time.perf_counter(), time.process_time()
        pixels = np.array(self._library.render(scene, spp=spp, seed=seed))
        return Picture(sampler.sample_count(), time.perf_counter() - start, time.process_time() - cpu, pixels)

    @cached_property
    def _scene(self) -> Any:
        given = self._given
        return self._library.load_dict(native(self._library, given)) if isinstance(given, dict) else given


def newest_llvm(root: Path = Path("/")) -> tuple[int, Path | None]:
    """Return version and file of the newest LLVM library in LLVM_FOLDERS; 0 and None if there is none."""
    found = {
        int(version[1]): file
        for folder in LLVM_FOLDERS
        for file in root.glob(f"{folder}/libLLVM*")
        if (version := re.match(r"libLLVM(?:-|\.so\.)(\d+)", file.name))
    }
    return max(found.items(), default=(0, None))


def load(variant: str | None = None) -> tuple[Any, str]:
    """Return the module with its variant chosen, and a name; by default parallel with LLVM, otherwise scalar."""
    version, file = newest_llvm()
    if version >= OLDEST_LLVM:
        os.environ.setdefault(LLVM_VARIABLE, str(file))
    variant = variant or ("llvm_ad_rgb" if LLVM_VARIABLE in os.environ else "scalar_rgb")
    library = import_module("mitsuba")
    library.set_variant(variant)
    library.set_log_level(library.LogLevel.Error)
    for plugin in PLUGINS:
        import_module(f".mitsuba_plugins.{plugin}", __package__)
    return library, f"mitsuba {variant.split('_')[0]}"


def native(library: Any, value: Any) -> Any:
    """Convert the values of `mitsuba_scene` to Mitsuba's objects."""
    match value:
        case {"type": "mesh"}:
            return _mesh(library, **{name: native(library, entry) for name, entry in value.items() if name != "type"})
        case dict():
            return {name: native(library, entry) for name, entry in value.items()}
        case np.ndarray() if value.shape == (4, 4):
            return library.ScalarTransform4f(value)
        case np.ndarray() if value.ndim == 3:
            return library.Bitmap(value)
    return value


def _mesh(
    library: Any,
    *,
    vertices: Any,
    faces: Any,
    normals: Any,
    uv: Any = None,
    colors: Any = None,
    opacity: Any = None,
    **plugins: Any,
) -> Any:
    """Return a mesh with its BSDF and emitter; flat-shaded if it has no normals."""
    properties = library.Properties()
    properties["face_normals"] = normals is None
    for name, plugin in plugins.items():
        properties[name] = library.load_dict(plugin)
    mesh = library.Mesh(
        "mesh",
        len(vertices),
        len(faces),
        properties,
        has_vertex_normals=normals is not None,
        has_vertex_texcoords=uv is not None,
    )
    if colors is not None:
        mesh.add_attribute("vertex_color", 3, colors.ravel())
    if opacity is not None:
        mesh.add_attribute("vertex_opacity", 1, opacity)
    arrays = library.traverse(mesh)
    arrays["vertex_positions"], arrays["faces"] = vertices.ravel(), faces.ravel()
    if normals is not None:
        arrays["vertex_normals"] = normals.ravel()
    if uv is not None:
        arrays["vertex_texcoords"] = uv.ravel()
    arrays.update()
    return mesh
