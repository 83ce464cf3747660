"""Drivers that limit loop iterations.

Mesa's llvmpipe limits each vector of work-items to 65 535 loop iterations in total, counting nested loops and those of
all functions; after that every loop ends after its first iteration, without an error. (LP_MAX_TGSI_LOOP_ITERATIONS, a
guard against endless shaders.) With such a limit, launches are split to stay below it, and kernels verify that they did
(kernels/core/loop_limit.cl).
"""

from __future__ import annotations

import json

import numpy as np
import pyopencl as cl

from .. import cache_files
from ..device_info import identity_of
from ..driver_errors import driver_errors
from ..open import Device
from ..programs.program import build, compose, make_kernel

#: Suffix of the files that cache the limits, and the number of iterations up to which a limit is searched for.
KIND, TURNS = "loops.json", 100_000
_MULTIPLIER, _INCREMENT = 1664525, 1013904223
_known: dict[str, int | None] = {}


def loop_turns(device: Device) -> int | None:
    """Return how many loop iterations a work-item may run in total, or None without such a limit.

    The limit is cached in memory and on disk. Drivers whose work-items run one by one have no limit and are not tested.
    """
    if device.vectors:
        return None
    if device.info.id not in _known:
        name, of = f"{device.info.id}.{KIND}", identity_of(device.info)
        try:
            kept = json.loads(cache_files.read_file(name) or b"null")
            turns = kept["turns"] if kept["of"] == of and isinstance(kept["turns"], int | None) else -1
        except (ValueError, TypeError, LookupError, RecursionError):
            turns = -1
        if turns == -1:
            turns = measured_turns(device)
            cache_files.write_file(name, json.dumps({"of": of, "turns": turns}).encode())
        _known[device.info.id] = turns
    return _known[device.info.id]


def turns_source() -> str:
    """Return the source of the program that `measured_turns` runs."""
    return compose("", "check/turns.cl", {})


@driver_errors()
def measured_turns(device: Device) -> int | None:
    """Measure how many of TURNS iterations a loop runs: None if all, 0 if its result is wrong in another way."""
    kernel = make_kernel(device, build(device, turns_source()), "turns")
    number = np.full(1, 7, np.uint32)
    given, made = (
        cl.Buffer(device.context, cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR, hostbuf=number)
        for _ in range(2)
    )
    kernel.set_args(given, np.uint32(TURNS), made)
    cl.enqueue_nd_range_kernel(device.queue, kernel, (1,), (1,))
    cl.enqueue_copy(device.queue, number, made)
    numbers = [7]
    for _ in range(TURNS):
        numbers.append((_MULTIPLIER * numbers[-1] + _INCREMENT) % (1 << 32))
    if number[0] == numbers[-1]:
        return None
    return numbers.index(number[0]) if number[0] in numbers else 0
