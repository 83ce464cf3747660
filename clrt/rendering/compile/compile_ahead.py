"""Early program compilation, in parallel with the BVH build if the builder has to be compiled, too: both take as long.

The program does not depend on the triangle count of a mesh, so it is derived from an outline with one triangle per
mesh. If the outline yields a different program, the right one is compiled later, when it is needed.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...accel.build import FEW_SPHERES, builder_source, fitting_layout
from ...device.open import Device
from ...device.programs.compile_process import LARGE
from ...device.programs.program import compile_ahead, is_kept
from ...errors import ClrtError
from ...scene.model import Mesh, Scene
from ...threads import beside
from .choices import Choices
from .materials.vertex_alpha import with_vertex_alpha

#: Approximate factor by which packing enlarges a scene in memory; and the maximum number of primitives in an outline.
PACKED, MOST = 3, 1000
PER_VERTEX = ("vertices", "normals", "uv", "uv1", "colors", "tangents")


def begin_program(scene: Scene, choices: Choices, device: Device, source: Callable[[Scene, Choices], str]) -> None:
    """Compile the program `source` of a scene in another process, if that saves time and takes little memory."""
    if not device.is_pocl or scene.instances or _processors() < 2:
        return
    count, spheres = sum(len(mesh.faces) for mesh in scene.meshes), len(scene.spheres)
    in_tree = spheres if spheres > FEW_SPHERES else 0
    layout = choices.layout or fitting_layout(device, count, in_tree, choices.tests.triangle, False, choices.tree)
    with suppress(ClrtError):  # errors are reported by the regular compilation
        outlined = outline(with_vertex_alpha(scene))
        builder = builder_source(device, layout, choices.builder, count, in_tree)
        if (
            builder is None
            or is_kept(device, builder)
            or PACKED * _bytes(scene) > LARGE
            or sum(len(mesh.faces) for mesh in outlined.meshes) + spheres > MOST
        ):
            return
        beside(lambda: _compile(device, outlined, replace(choices, layout=layout), source), daemon=True)


def _compile(device: Device, outlined: Scene, choices: Choices, source: Callable[[Scene, Choices], str]) -> None:
    with suppress(ClrtError):  # the error recurs in the regular compilation
        compile_ahead(device, source(outlined, choices))


def _processors() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def outline(scene: Scene) -> Scene:
    """Return the scene with each mesh that is not emissive reduced to one triangle."""
    return replace(
        scene, meshes=[mesh if any(mesh.material.radiance) else _one_triangle(mesh) for mesh in scene.meshes]
    )


def _one_triangle(mesh: Mesh) -> Mesh:
    arrays: dict[str, Any] = {name: getattr(mesh, name) for name in PER_VERTEX}
    return replace(
        mesh,
        faces=np.arange(3, dtype=np.int32)[None],
        **{name: values[mesh.faces[0]] for name, values in arrays.items() if values is not None},
    )


def _bytes(scene: Scene) -> int:
    """Return the size of its arrays, which are packed twice."""
    arrays: list[NDArray[Any] | None] = [
        getattr(mesh, name) for mesh in scene.meshes for name in ("faces", *PER_VERTEX)
    ]
    materials = [mesh.material for mesh in scene.meshes] + [sphere.material for sphere in scene.spheres]
    arrays += [p.texels for p in {texture.picture for each in materials for texture in each.textures()}]
    arrays.append(scene.environment.image)
    return sum(array.nbytes for array in arrays if array is not None)
