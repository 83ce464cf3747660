"""Memory planning: whether a scene fits the device, and arrays split into parts where its largest buffer is smaller."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import NoRoomError
from .buffer_limit import VARIABLE
from .device_info import DeviceInfo

#: Records that a part shares with the next one, so that a leaf's records are never in two parts
#: (kernels/core/arrays.cl).
OVERLAP = 16


def part_records(itemsize: int, part_bytes: int) -> int:
    """Return how many records of `itemsize` bytes a part has without its overlap.

    Raises NoRoomError if there is no room for one.
    """
    records = part_bytes // itemsize - OVERLAP
    if records < 1:
        raise NoRoomError(
            f"buffers of {part_bytes} bytes are too small for this scene: {OVERLAP + 1} of its largest "
            f"records must fit; set {VARIABLE} to {(OVERLAP + 1) * itemsize} or more"
        )
    return records


def needed_parts(arrays: Iterable[Any], info: DeviceInfo) -> int | None:
    """Return the device's largest buffer if one of the arrays is larger, so that all are split to parts; else None."""
    sizes = [(array.nbytes, array.dtype.itemsize) for array in arrays]
    if all(size <= info.max_alloc_bytes for size, _ in sizes):
        return None
    part_records(max(itemsize for _, itemsize in sizes), info.max_alloc_bytes)
    return info.max_alloc_bytes


def parts(array: NDArray[Any], part_bytes: int | None) -> Iterator[NDArray[Any]]:
    """Yield the parts of an array, none larger than `part_bytes`; the array itself if that is None."""
    own = max(1, len(array)) if part_bytes is None else part_records(array.itemsize, part_bytes)
    for first in range(0, max(1, len(array)), own):
        yield array[first : first + own + (0 if part_bytes is None else OVERLAP)]


def part_count(array: Any, part_bytes: int | None) -> int:
    """Return the number of parts of a numpy or device array."""
    return 1 if part_bytes is None else max(1, -(-len(array) // part_records(array.dtype.itemsize, part_bytes)))


def check_memory(info: DeviceInfo, needs: Mapping[str, int], parameter_bytes: int, most_parameter_bytes: int) -> None:
    """Check that buffers of these sizes fit the device, and that a kernel can take an argument for each part.

    Raises NoRoomError, with the numbers, otherwise. parameter_bytes: size of the kernel's parameters.
    """
    check_room(info, needs)
    if parameter_bytes > most_parameter_bytes:
        raise NoRoomError(
            f"{info.name}: its buffers are at most {size(info.max_alloc_bytes)}, and the scene of "
            f"{size(sum(needs.values()))} needs more of them than the about {most_parameter_bytes // 8} "
            f"that a kernel takes; use another --device or a smaller scene (or set {VARIABLE} to more)"
        )


def check_room(info: DeviceInfo, needs: Mapping[str, int]) -> None:
    """Raise NoRoomError, with the numbers, if buffers of these sizes, by what they hold, do not fit."""
    total = sum(needs.values())
    if total > info.global_bytes:
        largest = sorted(needs, key=lambda name: -needs[name])[:4]
        told = ", ".join(f"{name} {size(needs[name])}" for name in largest)
        raise NoRoomError(
            f"{info.name}: this render needs {size(total)} ({told}), and the device has "
            f"{size(info.global_bytes)}; use another --device, or smaller or fewer images and models"
        )


def check_host(film_bytes: int, width: int, height: int) -> None:
    """Raise NoRoomError if this machine has no room for a film and for the same size again of derived data."""
    memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") if hasattr(os, "sysconf") else 2 * film_bytes
    if 2 * film_bytes > memory:
        raise NoRoomError(
            f"an image of {width}x{height} needs {size(2 * film_bytes)} of memory, and this machine has "
            f"{size(memory)}; render a smaller --size"
        )


def size(count: int) -> str:
    """Format a number of bytes for display."""
    exponent = min(3, max(0, (int(count).bit_length() - 1) // 10))
    return f"{count / (1 << 10 * exponent):.4g} {('bytes', 'KiB', 'MiB', 'GiB')[exponent]}"


def array_bytes(array: Any, part_bytes: int | None) -> int:
    """Return the size of an array on the device, including the overlap of its parts."""
    return int(array.nbytes + (part_count(array, part_bytes) - 1) * OVERLAP * np.dtype(array.dtype).itemsize)
