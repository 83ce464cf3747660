"""Build the BVH for a device: choose the builder, and run it in numpy or on the device."""

from __future__ import annotations

import time

import numpy as np

from ..device.launches.device_arrays import DeviceArray
from ..device.open import Device
from ..errors import UsageError, check_choice
from . import device_builder
from .builders import BUILDERS
from .bvh import FloatArray, Triangles
from .layouts import LAYOUTS, LEAF_SPHERE, PACK, Layout, pack
from .triangle_forms import in_form

#: Builders that run on the device, with the number of reinsertion passes that follow.
DEVICE_BUILDERS = {"ploc": 0, "reinsertion": 2}
#: From this many primitives on, a build on the device is faster than numpy's, including loading its kernels from the
#: cache.
LARGE = 1 << 14
#: Up to this many spheres are intersected one after another, for all SIMD lanes together
#: (kernels/traverse/lone_spheres.cl).
FEW_SPHERES = 16
#: Up to this many triangles, brute force is as fast as a BVH, and up to half as many 1.5 times as fast, or 1.2 times
#: with half packs (kernels/geometry/wide.cl).
FEW = 4 * PACK


def fitting_layout(
    device: Device | None,
    triangles: int,
    spheres: int,
    triangle: str = "watertight",
    instances: bool = False,
    tree: bool | None = None,
) -> str:
    """Return the device's layout, or "packs" (brute force) if the SIMD layout would have too few primitives for a BVH.

    triangles, spheres: how many are to be in the BVH. tree: True forces a BVH, False forces brute force.
    """
    layout = device.layout if device else "bvh8"
    packs = layout == "bvh8" and triangle == "watertight"
    few = 0 < triangles <= FEW and not (spheres or instances)
    if tree is False:
        return "packs" if packs else "list"
    return "packs" if packs and few and tree is None else layout


def build_tree(
    device: Device | None,
    layout: str,
    builder: str | None,
    triangles: Triangles,
    spheres: FloatArray | None = None,
    triangle: str = "watertight",
) -> Layout:
    """Build the BVH over triangles (m, 3, 3) and spheres (s, 4), float32, finite, of sizes near 1.

    builder: a name in BUILDERS or DEVICE_BUILDERS; None selects the fastest. Without a device, and for fewer than two
    primitives, `sah` replaces those that run on the device. triangle: the intersection test that the leaves are for.
    Raises UsageError for unknown names and for layouts that the builder, or the test, does not support.
    """
    check_choice("layout", layout, LAYOUTS)
    if layout == "packs" and triangle != "watertight":
        raise UsageError(f"the layout packs supports the triangle test watertight, not {triangle}; use another layout")
    spheres = np.zeros((0, 4), np.float32) if spheres is None else spheres
    return in_form(_over_corners(device, layout, builder, triangles, spheres), triangle, device)


def builder_source(device: Device, layout: str, builder: str | None, triangles: int, spheres: int) -> str | None:
    """Return the program that builds the BVH over this many primitives, or None if numpy builds it.

    Raises UsageError as `build_tree` does.
    """
    builder = _fitting_builder(device, layout, builder, triangles + spheres)
    if builder not in DEVICE_BUILDERS:
        return None
    return device_builder.program_source(
        device_builder.SHAPES[layout], triangles > 0, spheres > 0, DEVICE_BUILDERS[builder] > 0
    )


def _fitting_builder(device: Device | None, layout: str, builder: str | None, count: int) -> str:
    known = [*DEVICE_BUILDERS, *BUILDERS]
    check_choice("builder", builder, (None, *known))
    if builder is None:
        device_can = layout in device_builder.SHAPES and device_builder.fits(device, count)
        builder = "ploc" if device_can and count >= LARGE else "sah"
    if builder in DEVICE_BUILDERS and (device is None or count < 2):
        return "sah"
    if builder in DEVICE_BUILDERS and layout not in device_builder.SHAPES:
        raise UsageError(
            f"the builder {builder} builds {', '.join(device_builder.SHAPES)}, not {layout}; use the builder sah"
        )
    return builder


def _over_corners(
    device: Device | None, layout: str, builder: str | None, triangles: Triangles, spheres: FloatArray
) -> Layout:
    builder = _fitting_builder(device, layout, builder, len(triangles) + len(spheres))
    if builder not in DEVICE_BUILDERS or device is None:
        return pack(layout, builder, np.asarray(triangles), spheres)
    start = time.perf_counter()
    shape = device_builder.SHAPES[layout]
    tree = device_builder.build_tree(device, shape, triangles, spheres, DEVICE_BUILDERS[builder])
    names, dtypes = ("nodes", shape.leaves, "leaf_spheres"), (shape.node, shape.leaf, LEAF_SPHERE)
    buffers = {
        name: DeviceArray(buffer, dtype, size)
        for name, buffer, dtype, size in zip(names, tree.arrays, dtypes, tree.counts)
        if size
    }
    seconds = time.perf_counter() - start
    return Layout(
        layout,
        buffers,
        tree.stack,
        tree.nodes,
        tree.depth,
        tree.sah_cost,
        seconds,
        builder,
        tuple(tree.level_sizes),
        tree.peak_bytes,
    )
