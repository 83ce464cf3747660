"""The buffers of a guiding field, which directions of paths are sampled from (kernels/guiding/field.cl)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...device.programs.preamble import Buffers
from .records import QUARTER, SPATIAL_NODE


def field_buffers(nodes: NDArray[Any], quarters: NDArray[Any]) -> Buffers:
    """Return the buffers of a field. nodes: SPATIAL_NODE records, the root first; quarters: QUARTER records."""
    return {"spatial_nodes": ("SpatialNode", nodes), "quarters": ("Quarter", quarters)}


#: The field before training, from which no direction is sampled.
UNTRAINED = field_buffers(np.array([(-1, 0, 0, 0)], SPATIAL_NODE), np.array([(0.25, -1)] * 4, QUARTER))
