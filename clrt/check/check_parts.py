"""The parts of a check, ordered so that failures of earlier ones explain those of later ones."""

from __future__ import annotations

from collections.abc import Callable

from ..device.open import Device
from .arithmetic import check_arithmetic
from .comparisons import check_comparisons
from .findings import Findings
from .integers import check_integers
from .known_pictures import check_ball, check_furnace, check_lamp, check_room
from .known_rays import check_binary_tree, check_rays, check_tree_builder
from .masks import check_masks
from .samples import check_random_numbers, check_sums
from .vector_memory import check_memory

PARTS: dict[str, Callable[[Device, Findings], None]] = {
    "arithmetic": check_arithmetic,
    "comparisons": check_comparisons,
    "integers": check_integers,
    "masks": check_masks,
    "memory": check_memory,
    "random numbers": check_random_numbers,
    "sums": check_sums,
    "rays": check_rays,
    "binary tree": check_binary_tree,
    "tree builder": check_tree_builder,
    "furnace": check_furnace,
    "lamp": check_lamp,
    "ball": check_ball,
    "room": check_room,
}
