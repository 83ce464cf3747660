"""The buffers of a guiding field, which directions of paths are sampled from (kernels/guiding/field.cl)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...device.programs.preamble import Buffers
from ...errors import UsageError
from ...scene.model import Scene
from ...scene.ray_list import RayList
from .records import QUARTER, SPATIAL_NODE


def field_buffers(nodes: NDArray[Any], quarters: NDArray[Any]) -> Buffers:
    """Return the buffers of a field. nodes: SPATIAL_NODE records, the root first; quarters: QUARTER records."""
    return {"spatial_nodes": ("SpatialNode", nodes), "quarters": ("Quarter", quarters)}


def check_guiding(scene: Scene) -> None:
    """Raise UsageError unless the scene's paths can be guided."""
    if isinstance(scene.camera, RayList):
        raise UsageError("guiding needs a camera: paths from lists of points or rays are not guided; leave it out")
    if scene.render.integrator != "path":
        raise UsageError(f"guiding needs the integrator path, not {scene.render.integrator}; leave out one of them")


#: The field before training, from which no direction is sampled.
UNTRAINED = field_buffers(np.array([(-1, 0, 0, 0)], SPATIAL_NODE), np.array([(0.25, -1)] * 4, QUARTER))
