"""Support for devices whose driver ends loops early: few samples per launch, none of them missing.

See device/launches/driver_loop_limits.py.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...accel.layouts import Layout
from ...device.launches.device_arrays import DeviceArray
from ...device.launches.driver_loop_limits import loop_turns
from ...device.open import Device
from ...errors import DeviceError
from ..film.film import Film
from ..film.tiles import tile_pixels
from .work_queue import WorkQueue

#: Upper estimates of the loop iterations of a path vertex besides its two rays, and of a ray in a large BVH.
EDGE_TURNS, RAY_TURNS = 64, 1000
#: Fraction of the limit that a launch may use, as a divisor: work-items that run as one vector wait for each other in
#: every loop.
MARGIN = 4
#: Byte that marks records not written yet; no record begins with four of them.
MARK = 0xFE


def most_samples(device: Device, tree: Layout, primitives: int, max_depth: int) -> int | None:
    """Return the maximum samples per pixel in one launch, at least 1; None if the driver does not end loops."""
    turns = loop_turns(device)
    if turns is None:
        return None
    ray = min(tree.nodes + primitives, RAY_TURNS)
    return max(1, turns // (MARGIN * max_depth * (2 * ray + EDGE_TURNS)))


def check_samples(device: Device, film: Film, work: WorkQueue, size: tuple[int, int]) -> None:
    """Raise DeviceError if loops of finished work-items were ended: the film then lacks their samples."""
    turns = loop_turns(device)
    if turns is None or work.parts:
        return
    wanted = int(np.sum(work.samples * tile_pixels(size)))
    if film.samples < wanted:
        raise _refusal(device, turns, f"{wanted - film.samples} of {wanted} samples")


def mark_pixels(device: Device, pixels: DeviceArray) -> None:
    """Fill the buffer with MARK, which remains where a kernel does not store a record because its loops were ended."""
    if loop_turns(device) is not None:
        pixels.write(device, np.full(pixels.nbytes, MARK, np.uint8).view(pixels.dtype))


def check_pixels(device: Device, pixels: NDArray[Any]) -> None:
    """Raise DeviceError if records still begin with marks."""
    turns = loop_turns(device)
    if turns is None:
        return
    left = np.all(pixels.reshape(-1, 1).view(np.uint8)[:, :4] == MARK, axis=1)
    if left.any():
        raise _refusal(device, turns, f"{np.count_nonzero(left)} of {left.size} pixels")


def check_paths(device: Device, unfinished: int, paths: int) -> None:
    """Raise DeviceError if loops that traced `unfinished` of `paths` paths were ended."""
    if unfinished:
        raise _refusal(device, loop_turns(device) or 0, f"{unfinished} of {paths} paths")


def _refusal(device: Device, turns: int, what: str) -> DeviceError:
    return DeviceError(
        f"{device.info.name} ({device.info.platform}): the driver ends every loop of a work-item after "
        f"{turns} iterations, and {what} of this scene need more; use another device, or shorten "
        "the paths with --depth"
    )
