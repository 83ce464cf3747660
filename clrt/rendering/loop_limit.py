"""Renders on devices whose driver ends loops early (device/loops.py): few samples a launch, and none may be missing."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..accel.layouts import Layout
from ..device.arrays import DeviceArray
from ..device.loops import loop_turns
from ..device.open import Device
from ..errors import DeviceError
from .film import Film
from .tiles import tile_pixels
from .work import Work

#: Turns that an edge of a path takes beside its two rays, and a ray takes in a large tree, both on the high side.
EDGE_TURNS, RAY_TURNS = 64, 1000
#: The part of a limit that a launch may use: work-items that run as one vector wait for each other in every loop.
MARGIN = 4
#: A byte; four of them are no number that a record begins with.
MARK = 0xFE


def most_samples(device: Device, tree: Layout, primitives: int, max_depth: int) -> int | None:
    """Samples of a pixel in one launch, at least 1; None where the device's driver ends no loops."""
    turns = loop_turns(device)
    if turns is None:
        return None
    ray = min(tree.nodes + primitives, RAY_TURNS)
    return max(1, turns // (MARGIN * max_depth * (2 * ray + EDGE_TURNS)))


def check_samples(device: Device, film: Film, work: Work, size: tuple[int, int]) -> None:
    """DeviceError where loops of work-items that are done were ended: the film then lacks their samples."""
    turns = loop_turns(device)
    if turns is None or work.parts:
        return
    wanted = int(np.sum(work.samples * tile_pixels(size)))
    if film.samples < wanted:
        raise _refusal(device, turns, f"{wanted - film.samples} of {wanted} samples")


def mark_pixels(device: Device, pixels: DeviceArray) -> None:
    """Puts MARK where a kernel is to store a record for each pixel, and does not if its loops were ended."""
    if loop_turns(device) is not None:
        pixels.write(device, np.full(pixels.nbytes, MARK, np.uint8).view(pixels.dtype))


def check_pixels(device: Device, pixels: NDArray[Any]) -> None:
    """DeviceError where records still begin with marks."""
    turns = loop_turns(device)
    if turns is None:
        return
    left = np.all(pixels.reshape(-1, 1).view(np.uint8)[:, :4] == MARK, axis=1)
    if left.any():
        raise _refusal(device, turns, f"{np.count_nonzero(left)} of {left.size} pixels")


def check_paths(device: Device, unfinished: int, paths: int) -> None:
    """DeviceError where loops that followed `unfinished` of so many paths were ended."""
    if unfinished:
        raise _refusal(device, loop_turns(device) or 0, f"{unfinished} of {paths} paths")


def _refusal(device: Device, turns: int, what: str) -> DeviceError:
    return DeviceError(f"{device.info.name} ({device.info.platform}): the driver ends all loops of a work-item after "
                       f"{turns} turns, and {what} of this scene need more; use another device, or make paths shorter "
                       "with --depth")
