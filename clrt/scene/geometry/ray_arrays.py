"""Validation of rays given as three plain arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import UsageError
from ..fields.number_arrays import real_array

Rays = tuple[NDArray[Any], NDArray[Any], NDArray[Any]]


def ray_arrays(
    origins: ArrayLike, directions: ArrayLike, t_max: ArrayLike, names: tuple[str, str] = ("origins", "directions")
) -> Rays:
    """Broadcast to origins (n, 3), directions (n, 3) and t_max (n,); (3,), (3,) and () stand for all rays.

    names: what the caller calls the first two. Raises UsageError if the shapes do not match.
    """
    given = {names[0]: origins, names[1]: directions, "t_max": t_max}
    arrays = {name: real_array(name, values) for name, values in given.items()}
    count, counted = 1, ""
    for name, array in arrays.items():
        rays = array.shape if name == "t_max" else array.shape[:-1]
        if len(rays) > 1 or (name != "t_max" and array.shape[-1:] != (3,)):
            shapes = "(n,), or be one number for" if name == "t_max" else "(n, 3), or (3,) for"
            raise UsageError(f"{name} {array.shape} must have the shape {shapes} all rays")
        if rays in ((), (1,), (count,)):
            continue
        if counted:
            raise UsageError(f"{name} {array.shape}: there are {count} {counted}; give as many, or one for all")
        count, counted = rays[0], name
    return (
        np.broadcast_to(arrays[names[0]], (count, 3)),
        np.broadcast_to(arrays[names[1]], (count, 3)),
        np.broadcast_to(arrays["t_max"], count),
    )
