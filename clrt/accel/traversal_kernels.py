"""Kernel files and defines for BVH traversal: the part of a program that depends on the layout."""

from __future__ import annotations

from typing import Any, get_args

from .build import DEVICE_BUILDERS
from .builders import BUILDERS
from .layouts import NO_RAYS, PACK, Layout
from .methods import HitTests as HitTests, TriangleTest

#: Traversal files by layout, and the number of triangles per record.
TREES = {
    "bvh8": ("traverse/bvh8.cl", 8),
    "bvh2": ("traverse/bvh2.cl", 1),
    "cwbvh": ("traverse/cwbvh.cl", 1),
    "list": ("traverse/list.cl", 1),
    "packs": ("traverse/packs.cl", PACK),
}
#: Traversal files for instances, by layout.
UPPER_LEVELS = {
    "bvh8": "traverse/instance.cl",
    "bvh2": "traverse/slab_instance.cl",
    "cwbvh": "traverse/slab_instance.cl",
}
#: Builders by name.
BUILDER_NAMES = [*DEVICE_BUILDERS, *BUILDERS]
TRIANGLE_TESTS = {name: f"geometry/triangle_{name}.cl" for name in get_args(TriangleTest)}
#: The only triangle test of the layout packs.
PACKS_TEST = "geometry/triangle_watertight_packs.cl"
BOX_TESTS = {"robust": "geometry/box_robust.cl", "plain": "geometry/box_plain.cl"}
SPHERE_TESTS = {"robust": "geometry/sphere.cl", "textbook": "geometry/sphere_textbook.cl"}
RECORDS = {
    "nodes": "Node",
    "packs": "Triangles",
    "leaf_triangles": "Triangles",
    "leaf_spheres": "LeafSphere",
    "instances": "Instance",
    "visits": "Visits",
    "visit_ranges": "VisitRange",
    "visit_words": "VisitWord",
}


#: Unit of the stack's size: the stack of cwbvh, a group per level, is private memory of a GPU's work-item.
STACK_UNITS = {"cwbvh": 8}
STACK_UNIT = 64


def stack_size(tree: Layout) -> int:
    """Return the size of the traversal stack, at least that which the BVH needs."""
    unit = STACK_UNITS.get(tree.name, STACK_UNIT)
    return max(unit, -(-tree.stack // unit) * unit)


def tree_buffers(tree: Layout) -> dict[str, tuple[str, Any]]:
    """Return the BVH's buffers with their C types."""
    return {name: (RECORDS[name], array) for name, array in tree.buffers.items()}


def tree_defines(tree: Layout) -> dict[str, int]:
    """Return the defines PACK_SIZE and STACK_SIZE, and COUNT_VISITS or RECORD_VISITS (kernels/traverse/visits.cl).

    STACK_SIZE suffices for the traversal; it is rounded up (see STACK_UNITS) so that BVHs share programs.
    """
    if tree is NO_RAYS:
        return {}
    defines = {"PACK_SIZE": TREES[tree.name][1], "STACK_SIZE": stack_size(tree)}
    recorded = {"visits": "COUNT_VISITS", "visit_words": "RECORD_VISITS"}
    return defines | {define: 1 for name, define in recorded.items() if name in tree.buffers}


def tree_features(triangles: bool, spheres: bool, lone: bool = False, rays: bool = True) -> dict[str, bool]:
    """Return the feature flags of kernels/traverse. lone: spheres are not in the BVH; rays: whether rays are traced."""
    return {
        "TRIANGLES": triangles,
        "LEAF_SPHERES": rays and spheres and not lone,
        "LONE_SPHERES": rays and spheres and lone,
        "IN_TREE": rays and (triangles or (spheres and not lone)),
        "PRIMITIVES": triangles or spheres,
    }


def tree_files(
    layout: str,
    tests: HitTests,
    triangles: bool,
    spheres: bool,
    lone: bool = False,
    instances: bool = False,
    motion: bool = False,
) -> dict[str, list[str]]:
    """Return the files for the includes of kernels/traverse, for a scene with triangles, spheres or neither.

    layout: one of TREES, or that of NO_RAYS. motion: whether instances move.
    """
    sphere_test = [SPHERE_TESTS[tests.sphere]] if spheres else []
    if layout == NO_RAYS.name:
        return {"TREE": [], "LONE_SPHERES_FILE": [], "SPHERE_TEST": sphere_test}
    triangle_test = PACKS_TEST if layout == "packs" else TRIANGLE_TESTS[tests.triangle]
    return {
        "TREE": [TREES[layout][0]] if triangles or (spheres and not lone) else [],
        "LONE_SPHERES_FILE": ["traverse/lone_spheres.cl"] if lone else [],
        "BOX_TEST": [BOX_TESTS[tests.box]],
        "TRIANGLE_TEST": [triangle_test] if triangles else [],
        "UPPER_LEVEL": [UPPER_LEVELS[layout]] if instances else [],
        "MOTION_FILE": ["geometry/motion.cl"] if motion else [],
        "SPHERE_TEST": sphere_test,
    }
