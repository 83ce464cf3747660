"""A guiding field learned from recorded paths."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...device.programs.preamble import Buffers
from ..compile.guiding_field import field_buffers
from .quadtrees import morton_codes, quadtrees
from .radiance_cache import light_at
from .spatial_tree import spatial_tree

#: Vertices in a cell of the radiance cache, and in a leaf of the spatial tree.
CELL_VERTICES, LEAF_VERTICES = 500, 8000
#: The shares of directions from the field that are compared. The BSDF keeps enough for what the field has not seen.
SHARES = np.linspace(0.1, 0.7, 7)


def learned_field(vertices: NDArray[Any]) -> Buffers:
    """Return the buffers of the field learned from VERTEX records.

    Directions are in proportion to the light that surfaces reflect from them, BSDF and cosine included: leaves face one
    way, so that these belong to the light's distribution.
    """
    fine = spatial_tree(vertices["place"], CELL_VERTICES)
    cells = fine.leaves_at(vertices["place"])
    arriving, reflected = light_at(vertices, cells, fine.leaf_count)
    tree, leaf_of = fine.merged(LEAF_VERTICES)
    used = vertices["goes"]
    vertices, arriving, cells = vertices[used], arriving[used], cells[used]
    leaves, count = leaf_of[cells], tree.leaf_count
    codes = morton_codes(vertices["direction"])
    estimates = arriving * vertices["weight"]  # of the integral of the light reflected
    squares = estimates**2 * vertices["pdf"]
    trees = quadtrees(leaves, codes, estimates, squares, count)
    share = _shares(squares, trees.density(leaves, codes), vertices["bsdf_pdf"], leaves, count)
    held = np.maximum(np.bincount(leaves, minlength=count), 1)
    nodes, is_leaf = tree.nodes, tree.is_leaf
    number = nodes["child"][is_leaf]
    nodes["child"][is_leaf] = 4 * number
    nodes["value"][is_leaf] = share[number]
    nodes["reflected"][is_leaf] = (np.bincount(leaves, reflected[cells], count) / held)[number]
    return field_buffers(nodes, trees.quarters)


def _shares(
    squares: NDArray[np.float64],
    densities: NDArray[np.float64],
    bsdf_pdfs: NDArray[np.float32],
    leaves: NDArray[np.int32],
    count: int,
) -> NDArray[np.float64]:
    """Return for each leaf the share of the field for which the light reflected has the least second moment."""
    moments = [np.bincount(leaves, squares / (share * densities + (1 - share) * bsdf_pdfs), count) for share in SHARES]
    return np.asarray(SHARES[np.argmin(moments, axis=0)])
