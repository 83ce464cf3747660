"""Motion of instances and cameras between two poses: the position moves linearly, the rotation is that of a quaternion
turning at a constant rate about a fixed axis (Shoemake 1985), and the stretch, a symmetric matrix, changes linearly.

An affine matrix is the product of a rotation and a stretch (its polar decomposition; Shoemake and Duff 1992, "Matrix
Animation and Polar Decomposition"), so a rigid motion never shrinks what moves.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]
FloatArray = NDArray[np.float32]
#: Relative rounding error of a coordinate that the kernels transform at a time, or back (kernels/geometry/motion.cl).
ROUNDING = 64 * 2.0**-24
#: Angle by which what rotates turns between two poses whose boxes are computed.
STEP = np.pi / 32


class Turns(NamedTuple):
    """k rotations between two each: at the fraction s of the way cos(a)·middle + sin(a)·change, with a = (s − ½)·angle,
    is the quaternion (x, y, z, w).

    middle, change: (k, 4), unit and perpendicular to each other, change 0 if nothing turns; angle: (k,), of the
    quaternions, half of that by which the rotation turns: at most π/2, the shorter way.
    """

    middle: Doubles
    change: Doubles
    angle: Doubles

    @classmethod
    def between(cls, start: Doubles, end: Doubles) -> Turns:
        """Return those between rotations (k, 3, 3)."""
        one, other = quaternions(start), quaternions(end)
        other = np.where((one * other).sum(axis=1, keepdims=True) < 0, -other, other)
        total, change = np.linalg.norm(one + other, axis=1), np.linalg.norm(other - one, axis=1)
        middle = (one + other) / total[:, None]
        turned = (other - one) / np.where(change > 0, change, 1)[:, None]
        return cls(middle, turned, 2 * np.arctan2(change, total))

    def at(self, s: float) -> Doubles:
        """Return the rotations (k, 3, 3) at the fraction s of the way."""
        a = ((s - 0.5) * self.angle)[:, None]
        return _rotations(np.cos(a) * self.middle + np.sin(a) * self.change)


class Motion(NamedTuple):
    """k affine motions: at the fraction s of the way from the start to the end a point p is at offset(s) + R(s)·outer·
    (growth(s) ∘ (inner·p)), ∘ being the product by components.

    turn: R; offset: (k, 2, 3), at the start and its change; outer: (k, 3, 3); growth: (k, 3), its change from 1;
    inner: (k, 3, 4).
    """

    turn: Turns
    offset: Doubles
    outer: Doubles
    growth: Doubles
    inner: Doubles

    @classmethod
    def between(cls, start: Doubles, end: Doubles, pivot: Doubles) -> Motion:
        """Return the motions of matrices start, end (k, 3, 4), neither singular, both mirroring or neither.

        pivot: (k, 3, 4), from the points' frame to the one whose origin moves linearly and whose axes turn.
        """
        linear = np.linalg.inv(pivot[..., :3])
        (turn0, stretch0), (turn1, stretch1) = (_polar(each[..., :3] @ linear) for each in (start, end))
        first, last = (each[..., 3] - (each[..., :3] @ linear @ pivot[..., 3:])[..., 0] for each in (start, end))
        outer, growth = _diagonalized(stretch0, stretch1)
        offset = np.stack([first, last - first], axis=1)
        inner = np.linalg.inv(outer) @ stretch0 @ pivot
        return cls(Turns.between(turn0, turn1), offset, outer, growth, inner)

    def of(self, numbers: NDArray[np.integer]) -> Motion:
        """Return those of the motions with these numbers."""
        return Motion(Turns(*(each[numbers] for each in self.turn)), *(each[numbers] for each in self[1:]))

    def at(self, s: float) -> Doubles:
        """Return the matrices (k, 3, 4) at the fraction s of the way."""
        matrices = self.turn.at(s) @ self.outer @ ((1 + s * self.growth)[..., None] * self.inner)
        matrices[..., 3] += self.offset[:, 0] + s * self.offset[:, 1]
        return np.asarray(matrices)

    def to_world_bound(self) -> Doubles:
        """Return a matrix (k, 3, 3) whose entries bound |M(s)|·|M(s)^-1| at all s, each factor of M by itself."""
        grown = 1 + self.growth
        ratio = np.maximum(1.0, grown[:, :, None] / grown[:, None, :])
        inner = np.abs(self.inner[..., :3]) @ np.abs(np.linalg.inv(self.inner[..., :3]))
        middle = np.abs(self.outer) @ (ratio * inner) @ np.abs(np.linalg.inv(self.outer))
        return np.broadcast_to(middle.sum(axis=(1, 2))[:, None, None], middle.shape).copy()  # |R| has entries up to 1

    def boxes(self, own: Doubles) -> tuple[FloatArray, FloatArray]:
        """Return aabb_min, aabb_max (k, 3) of boxes (k, 2, 3) in all poses, padded for rounding.

        Between two poses a corner is at most h²/8·|f"| from the line between its places there, h being the step and f
        its path: an offset, linear in time, plus a vector, linear in time, that turns by an angle.
        """
        corners = np.stack([own[:, [x, y, z], [0, 1, 2]] for x in (0, 1) for y in (0, 1) for z in (0, 1)], axis=1)
        angle = 2 * self.turn.angle
        steps = int(np.ceil(max(1.0, (angle / STEP).max(initial=0.0))))
        low, high = np.full((len(own), 3), np.inf), np.full((len(own), 3), -np.inf)
        for s in np.linspace(0.0, 1.0, steps + 1):
            matrix = self.at(float(s))
            world = np.einsum("kij,kcj->kci", matrix[..., :3], corners) + matrix[:, None, :, 3]
            low, high = np.minimum(low, world.min(axis=1)), np.maximum(high, world.max(axis=1))
        inner = np.einsum("kij,kcj->kci", self.inner[..., :3], corners) + self.inner[:, None, :, 3]
        ends = [self.outer @ ((1 + s * self.growth)[..., None] * np.swapaxes(inner, 1, 2)) for s in (0.0, 1.0)]
        reach = np.maximum(*(np.linalg.norm(each, axis=1).max(axis=1) for each in ends))
        grown = np.linalg.norm(ends[1] - ends[0], axis=1).max(axis=1)
        bulge = (angle * angle * reach + 2 * angle * grown) / (8 * steps**2)
        size = np.abs(self.offset).sum(axis=(1, 2)) + reach
        pad = (bulge + ROUNDING * self.to_world_bound()[:, 0, 0] * size)[:, None]
        low, high = (low - pad).astype(np.float32), (high + pad).astype(np.float32)
        return np.nextafter(low, np.float32(-np.inf)), np.nextafter(high, np.float32(np.inf))

    def size(self) -> Doubles:
        """Return a bound (k,) of the entries of the linear part at all s."""
        grown = np.maximum(1.0, 1 + self.growth)
        linear = np.abs(self.outer) @ (grown[..., None] * np.abs(self.inner[..., :3]))
        return np.asarray(np.linalg.norm(linear, axis=1).max(axis=1))


def quaternions(rotations: Doubles) -> Doubles:
    """Return the unit quaternions (k, 4), x, y, z, w, of rotations (k, 3, 3) (Bar-Itzhack 2000)."""
    r = rotations
    xx, yy, zz = r[:, 0, 0], r[:, 1, 1], r[:, 2, 2]
    xy, xz, yz = r[:, 0, 1] + r[:, 1, 0], r[:, 0, 2] + r[:, 2, 0], r[:, 1, 2] + r[:, 2, 1]
    xw, yw, zw = r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]
    rows = [
        [xx - yy - zz, xy, xz, xw],
        [xy, yy - xx - zz, yz, yw],
        [xz, yz, zz - xx - yy, zw],
        [xw, yw, zw, xx + yy + zz],
    ]
    return np.asarray(np.linalg.eigh(np.moveaxis(np.array(rows), -1, 0))[1][..., -1])


def _rotations(q: Doubles) -> Doubles:
    """Return the rotations (k, 3, 3) of unit quaternions (k, 4)."""
    x, y, z, w = q.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def _polar(linear: Doubles) -> tuple[Doubles, Doubles]:
    """Return rotations R and symmetric S (k, 3, 3) with R S = the matrices; S is negative definite if they mirror."""
    u, stretch, v = np.linalg.svd(linear)
    turn, side = u @ v, np.sign(np.linalg.det(linear))
    return turn * side[:, None, None], np.swapaxes(v, 1, 2) @ ((side[:, None] * stretch)[..., None] * v)


def _diagonalized(start: Doubles, end: Doubles) -> tuple[Doubles, Doubles]:
    """Return P (k, 3, 3) and changes c (k, 3) with start + s·(end − start) = P (1 + s·c) P^-1 start for all s.

    start, end: symmetric and definite, with the same sign. P is the identity where only rounding differs.
    """
    side = np.sign(np.trace(start, axis1=1, axis2=2))[:, None, None]
    values, axes = np.linalg.eigh(side * start)
    root = axes * np.sqrt(values)[:, None, :]  # root·root' is |start|
    back = np.linalg.inv(root)
    change, turned = np.linalg.eigh(back @ (side * (end - start)) @ np.swapaxes(back, 1, 2))
    still = np.abs(change).max(axis=1) < 1e-12
    outer = np.where(still[:, None, None], np.eye(3), root @ turned)
    return outer, np.where(still[:, None], 0.0, change)
