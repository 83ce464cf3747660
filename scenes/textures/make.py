"""Writes the pictures of this folder, which scenes/textures.toml shows: python scenes/textures/make.py

All are made of sums of waves and of plain shapes, with numbers from a fixed seed.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import imageio.v3 as iio
import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]
FOLDER = Path(__file__).parent
RNG = np.random.default_rng(7)


def waves(points: Doubles, lowest: float, highest: float, count: int = 300, whole: bool = False) -> Doubles:
    """Noise at points (..., d), about from −1 to 1: waves in all directions, the weaker the shorter.

    whole: of whole numbers of waves over a unit of length, so that it goes on where the picture is repeated.
    """
    lengths = lowest * (highest / lowest) ** RNG.random(count)
    ways = RNG.normal(size=(count, points.shape[-1]))
    vectors = ways / np.linalg.norm(ways, axis=1, keepdims=True) * lengths[:, None]
    vectors = np.round(vectors) if whole else vectors
    total = np.zeros(points.shape[:-1])
    for vector, phase, length in zip(vectors, RNG.uniform(0, 2 * np.pi, count), lengths):
        total += np.cos(2 * np.pi * (points @ vector) + phase) * lowest / length
    return total / (2 * total.std())


def square(size: int) -> tuple[Doubles, Doubles]:
    """u and v at the middles of a picture's texels."""
    middle = (np.arange(size) + 0.5) / size
    return np.meshgrid(middle, middle)


def mixed(share: Any, dark: Any, light: Any) -> Doubles:
    """Colours between two, (..., 3)."""
    part = np.clip(share, 0, 1)[..., None]
    return np.asarray(np.array(dark) * (1 - part) + np.array(light) * part)


def step(value: Any, edge: float, width: float) -> Doubles:
    """0 below the edge, 1 above it, smooth over the width."""
    t = np.clip((value - edge) / width + 0.5, 0, 1)
    return np.asarray(t * t * (3 - 2 * t))


def normals(height: Doubles) -> Doubles:
    """The normal map of a height, in widths of the picture, that is repeated on all sides."""
    slope_x = (np.roll(height, -1, 1) - np.roll(height, 1, 1)) * len(height) / 2
    slope_y = (np.roll(height, -1, 0) - np.roll(height, 1, 0)) * len(height) / 2
    n = np.stack([-slope_x, slope_y, np.ones_like(height)], -1)  # v points down, the map's y up
    return 0.5 + 0.5 * n / np.linalg.norm(n, axis=-1, keepdims=True)


def save(name: str, picture: Doubles, **options: Any) -> None:
    iio.imwrite(FOLDER / name, np.round(picture.clip(0, 1) * 255).astype(np.uint8), **options)


def planks() -> None:
    """Four boards side by side, each with a grain of its own."""
    u, v = square(512)
    board = np.floor(4 * u)
    shift = np.array([0.0, 0.37, 0.71, 0.19])[board.astype(int)]
    along = (v + shift) % 1
    bend = waves(np.stack([u, along], -1), 1, 5, 80, whole=True)
    rings = np.sin(2 * np.pi * (14 * u + 1.1 * bend + 3 * shift))
    pores = waves(np.stack([48 * u % 1, along], -1), 2, 30, 150, whole=True)
    gap = step(np.abs(4 * u % 1 - 0.5), 0.488, 0.012)
    tone = 0.45 + 0.25 * rings + 0.13 * pores + 0.25 * (shift - 0.3)
    save("planks.jpg", mixed(tone, (0.40, 0.24, 0.13), (0.68, 0.47, 0.28)) * (1 - 0.75 * gap[..., None]), quality=85)
    save("planks_normal.jpg", normals(0.0009 * rings + 0.0005 * pores - 0.006 * gap), quality=85)


def tile() -> None:
    """A glazed tile with a flower, and its joint."""
    u, v = square(256)
    x, y = 2 * u - 1, 2 * v - 1
    r, angle = np.hypot(x, y), np.arctan2(y, x)
    corner, turn = np.hypot(1 - abs(x), 1 - abs(y)), np.arctan2(1 - abs(y), 1 - abs(x))
    flower = step(0.62 + 0.2 * np.cos(8 * angle) - r, 0, 0.03) * step(r - 0.3 + 0.08 * np.cos(8 * angle), 0, 0.03)
    middle = step(0.2 - r, 0, 0.03)
    arcs = step(0.06 - abs(corner - 0.62 - 0.04 * np.cos(12 * turn)), 0, 0.03)
    stars = step(0.28 + 0.12 * np.cos(8 * turn) - corner, 0, 0.03)
    color = mixed(flower, (0.93, 0.92, 0.87), (0.10, 0.24, 0.55))
    for share, paint in ((middle, (0.9, 0.62, 0.15)), (arcs, (0.16, 0.45, 0.68)), (stars, (0.9, 0.62, 0.15))):
        color = color * (1 - share[..., None]) + np.array(paint) * share[..., None]
    edge = np.maximum(abs(x), abs(y))
    joint = step(edge, 0.965, 0.02)[..., None]
    save("tile.jpg", color * (1 - joint) + np.array([0.55, 0.53, 0.5]) * joint, quality=88)
    save("tile_normal.png", normals(-0.02 * step(edge, 0.955, 0.09)))
    rough = 0.12 + 0.7 * joint[..., 0]
    save("tile_gloss.png", np.stack([0 * rough, rough, 0 * rough], -1))


def planet() -> None:
    """Land, seas and ice, around a ball."""
    u, v = np.meshgrid((np.arange(768) + 0.5) / 768, (np.arange(384) + 0.5) / 384)
    turn, down = 2 * np.pi * u, np.pi * v
    points = np.stack([np.sin(down) * np.sin(turn), np.cos(down), np.sin(down) * np.cos(turn)], -1)
    height = waves(points, 0.35, 8, 500) + 0.1
    detail = waves(points, 4, 40, 300)
    land = step(height, 0.12, 0.02)
    sea = mixed(step(height, -0.25, 0.8), (0.03, 0.11, 0.30), (0.10, 0.36, 0.55))
    dry = step(np.abs(v - 0.5) + 0.06 * detail, 0.13, 0.14)
    green = mixed(dry + 0.2 * detail, (0.72, 0.58, 0.33), (0.22, 0.40, 0.16))
    color = sea * (1 - land[..., None]) + mixed(step(height, 0.75, 0.5), green, (0.5, 0.42, 0.34)) * land[..., None]
    ice = step(np.abs(v - 0.5) + 0.03 * height + 0.015 * detail, 0.42, 0.02)[..., None]
    save("planet.jpg", color * (1 - ice) + 0.94 * ice, quality=85)


def worn() -> None:
    """Paint that has come off brass: colour, and metal in blue and roughness in green as glTF has them."""
    u, v = square(384)
    points = np.stack([u, v], -1)
    coarse, fine = waves(points, 2, 20, 300, whole=True), waves(points, 12, 80, 300, whole=True)
    bare = step(coarse + 0.25 * fine, 0.28, 0.06)
    rim = step(coarse + 0.25 * fine, 0.16, 0.1) - bare
    paint = mixed(0.5 + 0.25 * fine, (0.05, 0.33, 0.35), (0.09, 0.42, 0.42)) * (1 - 0.6 * rim[..., None])
    brass = mixed(0.5 + 0.4 * fine, (0.80, 0.62, 0.30), (0.93, 0.78, 0.45))
    save("worn.jpg", paint * (1 - bare[..., None]) + brass * bare[..., None], quality=88)
    save("worn_gloss.jpg", np.stack([0 * bare, 0.42 - 0.17 * bare + 0.08 * fine + 0.3 * rim, bare], -1), quality=90)


def lantern() -> None:
    """Paper with ribs and fish, that glows."""
    u, v = np.meshgrid((np.arange(512) + 0.5) / 512, (np.arange(256) + 0.5) / 256)
    ribs = 0.82 + 0.18 * np.abs(np.sin(12 * np.pi * v))
    x, y = 4 * (6 * u % 1 - 0.5), 8 * (v - 0.5 - 0.05 * np.cos(6 * np.pi * np.floor(6 * u)))
    body = step(1 - np.hypot(x / 1.1, y / 0.5), 0, 0.06)
    tail = step(0.45 - np.abs(y) - np.abs(x - 1.35) * 0.9, 0, 0.05) * step(x, 1.0, 0.05)
    fish = np.maximum(body, tail) * step(np.hypot(x + 0.65, y + 0.1), 0.11, 0.05)
    color = mixed(fish, (1.0, 0.80, 0.52), (0.85, 0.16, 0.06)) * ribs[..., None]
    caps = step(np.abs(v - 0.5), 0.45, 0.01)[..., None]
    save("lantern.jpg", color * (1 - caps) + 0.02 * caps, quality=88)


def leaf() -> None:
    """A leaf with its veins; what lies around it is cut out."""
    u, v = square(256)
    x, y = 2 * u - 1, v
    wide = 0.72 * np.sin(np.pi * np.clip(y, 0, 1)) ** 0.75 * (1 - 0.35 * (1 - y))
    inside = step(wide + 0.02 * np.sin(60 * y) - np.abs(x), 0, 0.015)
    stem = step(0.02 - np.abs(x), 0, 0.01)
    side = np.abs(np.sin(np.pi * (9 * y + 6 * np.abs(x))))
    veins = np.maximum(step(0.025 - np.abs(x), 0, 0.02), 0.5 * step(0.12 - side, 0, 0.1))
    color = mixed(veins, (0.16, 0.36, 0.08), (0.48, 0.62, 0.25)) * (0.85 + 0.15 * y[..., None])
    save("leaf.png", np.concatenate([color, np.maximum(inside, stem * (y > 0.5))[..., None]], -1))


def pixels() -> None:
    """Eight by eight, for the filter that keeps them square: a cow's head."""
    rows = ["o..xx..o", "ooxxxxoo", ".xxxxxx.", ".xkxxkx.", ".xxxxxx.", "..pppp..", "..pkkp..", "...pp..."]
    paints = {
        ".": (0.42, 0.68, 0.86),
        "x": (0.93, 0.91, 0.86),
        "o": (0.62, 0.45, 0.3),
        "k": (0.1, 0.09, 0.1),
        "p": (0.93, 0.6, 0.58),
    }
    save("pixels.png", np.array([[paints[letter] for letter in row] for row in rows]))


for draw in (planks, tile, planet, worn, lantern, leaf, pixels):
    draw()
