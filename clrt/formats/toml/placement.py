"""Keys of a scene file that transform a mesh or an instance to the world."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np

from ...errors import SceneError
from ...scene.fields.field_types import show
from ...scene.geometry.transform import Matrix, rotation, scaling, translation
from ...scene.model import Vector

Row = tuple[float, float, float, float]


@dataclass(frozen=True, kw_only=True)
class Transform:
    """Transform keys. A point is scaled, then rotated about the fixed x, y and z axes in this order, then translated;
    or it is multiplied by `matrix`, four rows."""

    translate: Vector = (0.0, 0.0, 0.0)
    scale: Vector = (1.0, 1.0, 1.0)
    rotate_degrees: Vector = (0.0, 0.0, 0.0)
    matrix: tuple[Row, Row, Row, Row] | None = None

    def to_world(self, where: str) -> Matrix:
        """Return the table's transform. Raises SceneError if it is given twice or is not affine."""
        if self.matrix is None:
            return translation(self.translate) @ rotation(self.rotate_degrees) @ scaling(self.scale)
        if any(getattr(self, key.name) != key.default for key in fields(Transform) if key.name != "matrix"):
            raise SceneError(f"{where}: has both a matrix and translate, scale or rotate_degrees; keep one of them")
        if self.matrix[3] != (0.0, 0.0, 0.0, 1.0):
            raise SceneError(f"{where}.matrix[3]: {show(self.matrix[3])} is not affine; write [0, 0, 0, 1]")
        return np.array(self.matrix, np.float64)

    def turn_fault(self, motion: Mapping[str, Any]) -> str | None:
        """Return the problem of a `motion` that rotates by more than a half turn about an axis; None if it does not."""
        start, end = self.rotate_degrees, tuple(motion.get("rotate_degrees", self.rotate_degrees))
        if all(abs(after - before) <= 180 for before, after in zip(start, end)):
            return None
        return (
            f"rotate_degrees: {show(end)} is more than 180 degrees from {show(start)}, and the shorter way is taken; "
            "write at most a half turn"
        )

    def moved(self, motion: Mapping[str, Any]) -> Self:
        """Return the table with the transform keys of its `motion`, which replace its own; a matrix replaces all."""
        keys = {key.name: key.default for key in fields(Transform)} if "matrix" in motion else {}
        return replace(self, **{**keys, **{name: value for name, value in motion.items() if name != "pivot"}})


@dataclass(frozen=True, kw_only=True)
class MotionTable(Transform):
    """Keys of a `motion`: the transform at the end of the exposure, and the point of what moves, before its transform,
    that does so in a straight line."""

    pivot: Vector = (0.0, 0.0, 0.0)
