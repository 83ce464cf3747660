"""Packing of which primitives are opaque to all rays, so these need not evaluate them (kernels/surface/opacity.cl)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ....scene.materials.material_types import Material
from ....scene.model import Scene
from ....scene.render_settings import Culling
from ..records import OPAQUE
from .pack_instances import PackedInstances


def opaque_records(
    scene: Scene, users: Sequence[Material], placements: PackedInstances, lights: NDArray[np.int32]
) -> NDArray[np.void]:
    """Return OPAQUE records of all triangles and spheres.

    scene: with the meshes that instances show first; users: materials of its meshes, spheres and instances; lights: of
    each triangle and sphere, or −1. Emitters are not opaque to all rays: shadow rays end at the one they were sent to.
    """
    catchers = any(user.catcher for user in users)
    each = [0 if catchers and not user.catcher else _opaque_to(user, scene.render.back_face_culling) for user in users]
    meshes, spheres, instances = np.split(np.array(each, np.uint8), np.cumsum([len(scene.meshes), len(scene.spheres)]))
    placed = placements.mesh[len(placements.mesh) - len(instances) :]
    np.minimum.at(meshes, placed, instances)
    records = np.concatenate([np.repeat(meshes, [len(mesh.faces) for mesh in scene.meshes]), spheres]).view(OPAQUE)
    records["rays"][lights >= 0] = 0
    return records


def _opaque_to(material: Material, culling: Culling) -> int:
    """Return what a surface of the material is opaque to: 0 not all rays, 1 all but the camera's, 2 all."""
    parameters = material.surface_parameters(culling)
    if "opacity" not in parameters:
        return 2
    one_sided = parameters["one_sided"]
    assert isinstance(one_sided, float)
    return 1 if parameters["opacity"] == 1 and one_sided % 2 < 1 else 0
