"""Procedural models made of tubes along curves: a dragon, a tree and a statue, as large as those of the theses.

The scans that the theses used cannot be redistributed. These have what matters for speed: the same number of
triangles, limbs that occlude each other, and relief at the scale of some triangles. +Y is up; they stand on y = 0 and
face +X. `python -m clrt.bench.theses.figures FOLDER` writes those in scenes/models.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...scene.splines import smooth
from ..rays.hard_meshes import icosphere
from ..rays.workloads import Mesh, joined

Doubles = NDArray[np.float64]


def tube(
    points: ArrayLike, radii: ArrayLike, rings: int, sides: int, relief: Doubles | float = 0.0, flat: float = 1.0
) -> Mesh:
    """Return a closed tube of 2·rings·sides triangles along a smooth curve through points (k, 3), with radii (k,).

    relief: relative increase of the radii, (rings, sides). flat: ratio of its width perpendicular to the plane of the
    curve's start to that in it.
    """
    knots = np.linspace(0, 1, len(np.asarray(points)))
    at = np.linspace(0, 1, rings)
    path, radius = smooth(knots, points, at), smooth(knots, np.reshape(radii, (-1, 1)), at)
    ahead = np.gradient(path, axis=0)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    side = np.zeros_like(ahead)
    side[0] = _across(ahead[0])
    for ring in range(1, rings):  # a frame without twist
        side[ring] = side[ring - 1] - ahead[ring] * (ahead[ring] @ side[ring - 1])
        side[ring] /= np.linalg.norm(side[ring])
    angles = 2 * np.pi * np.arange(sides) / sides
    cos, sin = np.cos(angles)[None, :, None], np.sin(angles)[None, :, None]
    around = cos * side[:, None] + flat * sin * np.cross(ahead, side)[:, None]
    bumps = np.broadcast_to(1 + np.asarray(relief), (rings, sides))[..., None]
    ends = path[[0, -1]] + np.array([[-0.5], [0.5]]) * radius[[0, -1]] * ahead[[0, -1]]
    vertices = np.concatenate([(path[:, None] + radius[:, None] * bumps * around).reshape(-1, 3), ends])
    return vertices.astype(np.float32), _skin(rings, sides)


def _skin(rings: int, sides: int) -> NDArray[np.int32]:
    """Return outward-facing faces between rings of vertices and two end vertices."""
    ring, side = np.mgrid[: rings - 1, :sides]
    a, b = ring * sides + side, ring * sides + (side + 1) % sides
    walls = np.stack([np.stack([a, b, b + sides], -1), np.stack([a, b + sides, a + sides], -1)]).reshape(-1, 3)
    first = np.arange(sides)
    following, last = (first + 1) % sides, (rings - 1) * sides
    caps = [
        np.stack([following, first, np.full(sides, rings * sides)], -1),
        np.stack([last + first, last + following, np.full(sides, rings * sides + 1)], -1),
    ]
    return np.concatenate([walls, *caps]).astype(np.int32)


def _across(direction: Doubles) -> Doubles:
    """Return a unit vector perpendicular to a direction: horizontal, if it is unique."""
    level = np.cross([0.0, 1.0, 0.0], direction)
    level = level if level.any() else np.array([1.0, 0.0, 0.0])
    return np.asarray(level / np.linalg.norm(level))


#: Points along the dragon's back, from the tip of the tail to the snout, and its radius there.
SPINE = np.array(
    [
        (-1.15, 0.95, 0.42),
        (-1.48, 0.62, 0.28),
        (-1.38, 0.24, -0.05),
        (-0.98, 0.2, -0.2),
        (-0.62, 0.5, -0.08),
        (-0.2, 0.72, 0.08),
        (0.25, 0.6, 0.06),
        (0.6, 0.62, -0.04),
        (0.8, 0.95, -0.06),
        (0.78, 1.3, 0.0),
        (1.0, 1.52, 0.05),
        (1.28, 1.44, 0.06),
        (1.5, 1.36, 0.06),
    ]
)
THICK = np.array([0.012, 0.04, 0.07, 0.11, 0.18, 0.23, 0.24, 0.21, 0.15, 0.115, 0.14, 0.11, 0.055])


def dragon() -> Mesh:
    """Return a scaly dragon of 19 332 triangles, 3 units long."""
    rings, sides = 220, 36
    along, around = np.arange(rings)[:, None], np.arange(sides)[None]
    scales = 0.06 * np.abs(np.sin(np.pi * along / 5)) * np.abs(np.cos(np.pi * (around / 6 + (along // 5) / 2)))
    parts = [tube(SPINE, THICK, rings, sides, scales)]
    for x, reach in ((-0.42, -0.12), (0.52, 0.16)):
        for z in (-1, 1):
            hip = np.array([x, 0.56, 0.1 * z])
            leg = hip + np.array(
                [
                    (0, 0, 0),
                    (0.1 - reach, -0.12, 0.2 * z),
                    (-0.12, -0.36, 0.24 * z),
                    (reach, -0.5, 0.24 * z),
                    (reach + 0.2, -0.53, 0.27 * z),
                ]
            )
            parts.append(tube(leg, [0.16, 0.14, 0.075, 0.06, 0.03], 20, 12))
    for z in (-1, 1):
        horn = np.array([(1.05, 1.6, 0.05), (0.9, 1.75, 0.05), (0.7, 1.86, 0.05), (0.5, 1.84, 0.05)])
        spread = np.outer([0.07, 0.13, 0.19, 0.27], [0, 0, z])
        parts.append(tube(horn + spread, [0.05, 0.04, 0.025, 0.004], 9, 9))
    return joined([*parts, *_crest()])


def _crest() -> list[Mesh]:
    """Return spikes along the back."""
    at = np.linspace(0.08, 0.85, 26)
    knots = np.linspace(0, 1, len(SPINE))
    path, ahead = smooth(knots, SPINE, at), smooth(knots, SPINE, at + 1e-3) - smooth(knots, SPINE, at - 1e-3)
    up = np.cross(np.cross(ahead, [0.0, 1.0, 0.0]), ahead)
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    thick = smooth(knots, THICK[:, None], at)
    back = ahead / np.linalg.norm(ahead, axis=1, keepdims=True)
    return [
        tube(
            [p + 0.8 * r * u, p + 1.3 * r * u - 0.1 * r * b, p + (1.4 * r + 0.05) * u - 0.35 * r * b],
            [0.3 * r[0] + 0.004, 0.16 * r[0] + 0.003, 0.002],
            4,
            6,
            flat=0.35,
        )
        for p, u, r, b in zip(path, up, thick, back)
    ]


def tree() -> tuple[Mesh, Mesh]:
    """Return a tree of 264 triangles, 3 units high: its wood (84) and its leaves (180)."""
    wood = [tube([(0, 0, 0), (0.04, 0.6, 0.02), (-0.03, 1.5, 0)], [0.17, 0.11, 0.06], 3, 6)]
    crown = [(0.0, 2.35, 0.0, 0.62)]
    for turn in range(3):
        angle = 2 * np.pi * turn / 3 + 0.4
        x, z = np.cos(angle), np.sin(angle)
        height = 1.0 + 0.18 * turn
        wood.append(tube([(0.02, height, 0.0), (0.62 * x, height + 0.42, 0.62 * z)], [0.07, 0.035], 2, 4))
        crown += [
            (0.7 * x, height + 0.55, 0.7 * z, 0.45),
            (0.45 * np.cos(angle + 1), 1.95 + 0.1 * turn, 0.45 * np.sin(angle + 1), 0.42),
        ]
    crown += [(0.32, 2.75, 0.12, 0.38), (-0.28, 2.7, -0.2, 0.36)]
    points, faces = icosphere(0)
    corners = points[faces]
    inside = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) < 0
    faces = np.where(inside[:, None], faces[:, ::-1], faces)
    leaves = [((np.float32(r) * points + (x, y, z)).astype(np.float32), faces) for x, y, z, r in crown]
    return joined(wood), joined(leaves)


def statue(detail: int = 4) -> Mesh:
    """Return a winged figure in a robe, 2.2 units high: 448 880 triangles at detail 4, about a 16th of that at 1."""

    def part(
        points: ArrayLike,
        radii: ArrayLike,
        rings: int,
        sides: int,
        folds: float = 0.0,
        count: int = 1,
        flat: float = 1.0,
    ) -> Mesh:
        rings, sides = rings * detail // 4, sides * detail // 4
        along, angle = np.linspace(0, 1, rings)[:, None], 2 * np.pi * np.arange(sides)[None] / sides
        relief = folds * (np.cos(count * angle + 3 * np.sin(5 * along)) + 0.25 * np.sin(37 * along + 2 * count * angle))
        return tube(points, radii, rings, sides, relief * (1 - along))

    robe = part(
        [(0, 0, 0), (0.02, 0.4, 0), (0, 1.0, 0), (-0.03, 1.3, 0), (0, 1.62, 0), (0.01, 1.78, 0)],
        [0.44, 0.34, 0.2, 0.22, 0.17, 0.06],
        450,
        400,
        0.12,
        17,
    )
    head = part(
        [(0, 1.74, 0), (0.03, 1.86, 0), (0.04, 2.0, 0), (0.02, 2.08, 0)], [0.06, 0.11, 0.1, 0.02], 130, 120, 0.05, 9
    )
    arms = [
        part(
            [(0, 1.55, 0.12 * z), (0.1 + lift / 4, 1.4 + lift / 2, 0.34 * z), (0.3, 1.35 + lift, 0.4 * z)],
            [0.09, 0.07, 0.035],
            100,
            60,
            0.1,
            5,
        )
        for z, lift in ((-1, 0.75), (1, 0.0))
    ]
    wings = [_wing(z, 421 * detail // 4, 20 * detail // 4) for z in (-1, 1)]
    return joined([robe, head, *arms, *wings])


def _wing(z: int, rings: int, sides: int) -> Mesh:
    along = np.linspace(0, 1, rings)[:, None]
    feathers = 0.35 * np.abs(np.sin(24 * np.pi * along)) * np.cos(2 * np.pi * np.arange(sides)[None] / sides)
    return tube(
        [(-0.12, 1.45, 0.08 * z), (-0.3, 1.75, 0.5 * z), (-0.4, 1.6, 0.95 * z), (-0.36, 0.95, 1.15 * z)],
        [0.1, 0.24, 0.26, 0.03],
        rings,
        sides,
        feathers,
        flat=0.15,
    )


def column(detail: int = 4) -> Mesh:
    """Return a fluted column, 3 units high: 62 784 triangles at detail 4."""
    rings, sides = 436 * detail // 4, 72 * detail // 4
    flutes = 0.08 * np.abs(np.cos(6 * 2 * np.pi * np.arange(sides)[None] / sides))
    return tube(
        [(0, 0, 0), (0, 0.15, 0), (0, 0.3, 0), (0, 1.6, 0), (0, 2.7, 0), (0, 2.85, 0), (0, 3, 0)],
        [0.34, 0.32, 0.2, 0.19, 0.17, 0.3, 0.34],
        rings,
        sides,
        flutes,
    )


def write_models(folder: Path) -> None:
    """Write dragon.ply and tree.obj, the files in scenes/models."""
    vertices, faces = dragon()
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment clrt/bench/theses/figures.py\n"
        f"element vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    rows = np.zeros(len(faces), np.dtype([("count", "u1"), ("corners", "<i4", 3)]))
    rows["count"], rows["corners"] = 3, faces
    (folder / "dragon.ply").write_bytes(header.encode() + vertices.astype("<f4").tobytes() + rows.tobytes())
    lines, first = ["# clrt/bench/theses/figures.py"], 1
    for name, (vertices, faces) in zip(("wood", "leaves"), tree()):
        lines += [
            f"o {name}",
            f"usemtl {name}",
            *("v {:.9g} {:.9g} {:.9g}".format(*row) for row in vertices.tolist()),
            *("f {} {} {}".format(*row) for row in (faces + first).tolist()),
        ]
        first += len(vertices)
    (folder / "tree.obj").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write_models(Path(sys.argv[1]))
