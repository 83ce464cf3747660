"""From primitives to the tree on a device: the builder is chosen, and where it runs."""

from __future__ import annotations

import time

import numpy as np

from ..device.arrays import DeviceArray
from ..device.open import Device
from ..errors import UsageError
from . import device_builder
from .builders import BUILDERS
from .layouts import LEAF_SPHERE, Layout, pack
from .tree import FloatArray
from .triangle_forms import in_form

#: Builders that run on the device, by the passes of reinsertion that follow.
DEVICE_BUILDERS = {"ploc": 0, "reinsertion": 2}
#: From so many primitives on a device's tree is done before numpy's, kernels loaded from the cache included.
LARGE = 1 << 14


def build_tree(device: Device | None, layout: str, builder: str | None, triangles: FloatArray,
               spheres: FloatArray | None = None, triangle: str = "watertight") -> Layout:
    """The tree over triangles (m, 3, 3) and spheres (s, 4), float32, finite, of sizes near 1.

    builder: a name in BUILDERS or DEVICE_BUILDERS; None takes the fastest. Without a device, and for fewer than two
    primitives, those on the device are stood in for by `sah`. triangle: the test that the leaves are for. Raises
    UsageError for unknown names and for layouts that the builder cannot make.
    """
    spheres = np.zeros((0, 4), np.float32) if spheres is None else spheres
    return in_form(_over_corners(device, layout, builder, triangles, spheres), triangle, device)


def _over_corners(device: Device | None, layout: str, builder: str | None, triangles: FloatArray,
                  spheres: FloatArray) -> Layout:
    count = len(triangles) + len(spheres)
    known = [*DEVICE_BUILDERS, *BUILDERS]
    if builder not in (None, *known):
        raise UsageError(f"there is no tree builder {builder!r}: take one of {', '.join(known)}")
    if builder is None:
        builder = "ploc" if device and count >= LARGE and layout in device_builder.SHAPES else "sah"
    if builder not in DEVICE_BUILDERS or device is None or count < 2:
        return pack(layout, "sah" if builder in DEVICE_BUILDERS else builder, triangles, spheres)
    if layout not in device_builder.SHAPES:
        raise UsageError(f"the builder {builder} makes {', '.join(device_builder.SHAPES)}, not {layout}: "
                         "take the builder sah")
    start = time.perf_counter()
    shape = device_builder.SHAPES[layout]
    tree = device_builder.build_tree(device, shape, triangles, spheres, DEVICE_BUILDERS[builder])
    names, dtypes = ("nodes", shape.leaves, "leaf_spheres"), (shape.node, shape.leaf, LEAF_SPHERE)
    buffers = {name: DeviceArray(buffer, dtype, size)
               for name, buffer, dtype, size in zip(names, tree.arrays, dtypes, tree.counts) if size}
    seconds = time.perf_counter() - start
    return Layout(layout, buffers, tree.stack, tree.nodes, tree.depth, tree.sah_cost, seconds, builder,
                  tuple(tree.level_sizes), tree.peak_bytes)
