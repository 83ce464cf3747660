"""Positions, texture coordinates and colors under the names that they have in PLY files."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .elements import Columns, Lists

Array = NDArray[Any]
#: Names of texture coordinates in use: by vertex or, as lists, by face; and of a list of both for each face.
COORDINATES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))
BY_FACE = ("texcoord", "texcoords", "texture_uv")
COLORS = (("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"), ("r", "g", "b"))
#: Value of white by type.
WHITE = {"u1": 255, "u2": 65535, "f4": 1, "f8": 1}


def columns_of(columns: Columns, names: Sequence[str]) -> Array | None:
    """Return the scalars of these names, (n, k); None if any is missing."""
    if not set(names) <= columns.scalars.keys():
        return None
    return np.column_stack([columns.scalars[name] for name in names])


def coordinates_of(vertex: Columns) -> Array | None:
    """Return the texture coordinates of vertices, (n, 2); None if there are none."""
    return next((found for pair in COORDINATES if (found := columns_of(vertex, pair)) is not None), None)


def colors_of(columns: Columns) -> Array | None:
    """Return the colors of vertices or faces, (n, 3) or with alpha (n, 4), white at 1; None if there are none."""
    names: tuple[str, ...] = next((names for names in COLORS if set(names) <= columns.scalars.keys()), ())
    if not names or columns.number == 0:
        return None
    names = (*names, *(name for name in ("alpha", "a") if name in columns.scalars))[:4]
    white = np.array([WHITE.get(columns.kinds[name], 255) for name in names], np.float32)
    return np.asarray(np.column_stack([columns.scalars[name] for name in names]) / white, np.float32)


def corner_coordinates(face: Columns, polygons: Lists) -> Array | None:
    """Return the texture coordinates of each corner of all faces, (c, 2), 0 where a face has none; None without any."""
    for name in BY_FACE:
        if name in face.lists:
            return _by_corner(face.lists[name], polygons, 2)
    for names in COORDINATES:
        if set(names) <= face.lists.keys():
            return np.column_stack([_by_corner(face.lists[name], polygons, 1) for name in names])
    return None


def _by_corner(lists: Lists, polygons: Lists, width: int) -> Array:
    """Return a list's items by corner of the polygons, (c, width); 0 for faces whose list has another length."""
    counts = polygons.counts.astype(np.int64)
    fits = np.repeat(lists.counts == width * counts, counts)
    taken = np.repeat(lists.counts == width * counts, lists.counts.astype(np.int64))
    rows = np.zeros((len(fits), width), np.float32)
    rows[fits] = lists.items[taken].reshape(-1, width)
    return rows
