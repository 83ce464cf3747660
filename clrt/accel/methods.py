"""Names of BVH layouts, builders and intersection tests; their kernel files are in traversal_kernels.py."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from ..option_fields import check_values, option

LayoutName = Literal["bvh8", "bvh2", "cwbvh", "packs", "list"]
BuilderName = Literal["ploc", "reinsertion", "sah", "midpoint"]
TriangleTest = Literal["watertight", "moller_trumbore", "precomputed", "baldwin_weber"]
BoxTest = Literal["robust", "plain"]
SphereTest = Literal["robust", "textbook"]
#: Brute-force layouts, whose cost per ray grows linearly with the number of primitives.
TREELESS = ("packs", "list")


@dataclass(frozen=True)
class HitTests:
    """Intersection tests. Raises UsageError for unknown ones.

    Tests that are not watertight or robust are for comparison: they lose hits or digits, as their files document.
    """

    triangle: str = option("watertight", "Triangle intersection test.", get_args(TriangleTest))
    box: str = option("robust", "Box intersection test.", get_args(BoxTest))
    sphere: str = option("robust", "Sphere intersection test.", get_args(SphereTest))

    def __post_init__(self) -> None:
        check_values(self)
