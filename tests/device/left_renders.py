"""Abandons renders and ray queries by a signal at a random point, and releases their arrays at once. Run it with freed
memory unmapped, so that a launch that still uses such memory crashes.

    MALLOC_MMAP_THRESHOLD_=4096 MALLOC_TOP_PAD_=0 python -m tests.device.left_renders DEVICE [unsafe]
"""

from __future__ import annotations

import signal
import sys
from typing import Any

import numpy as np
import pyopencl as cl

import clrt
from clrt.device.launches import device_arrays

RNG = np.random.default_rng(3)
ROUNDS, RAYS = 8, 60_000


class Left(BaseException):
    """Exception raised by the signal handler, a BaseException as KeyboardInterrupt is: libraries leave it alone."""


def scene() -> clrt.Scene:
    mesh = clrt.Mesh(RNG.random((3000, 3), np.float32), RNG.integers(0, 3000, (6000, 3), np.int32))
    return clrt.Scene(meshes=[mesh], environment=clrt.Environment(color=(1.0, 1.0, 1.0)))


def leave_soon() -> None:
    signal.setitimer(signal.ITIMER_REAL, 1e-3 + 0.1 * RNG.random())


def leave_render(device: int) -> None:
    try:
        for number, _ in enumerate(clrt.Renderer(scene(), size=(96, 96), spp=10**6, device=device).passes()):
            if number == 3:
                leave_soon()
    except Left:
        pass


def leave_query(query: clrt.RayQuery, name: str) -> None:
    origins, directions = RNG.random((RAYS, 3), np.float32), RNG.random((RAYS, 3), np.float32) - np.float32(0.5)
    try:
        leave_soon()
        while True:
            getattr(query, name)(origins, directions)
    except Left:
        pass


def main(device: int) -> None:
    def leave(number: int, frame: Any) -> None:
        raise Left

    query = clrt.RayQuery(RNG.random((3000, 3)), RNG.integers(0, 3000, (9000, 3)), device=device)
    for name in ("closest_hit", "any_hit", "all_hits"):
        getattr(query, name)([0, 0, 0], [1, 1, 1])
    signal.signal(signal.SIGALRM, leave)
    for number in range(ROUNDS):
        leave_render(device)
        leave_query(query, ("closest_hit", "any_hit", "all_hits")[number % 3])
    print("all left")


def unowned(device: Any, array: Any, access: int) -> cl.Buffer:
    """Return a buffer like `lend`, but without keeping the array alive."""
    return cl.Buffer(device.context, access | cl.mem_flags.USE_HOST_PTR, hostbuf=array)


if __name__ == "__main__":
    if "unsafe" in sys.argv:  # to see that it dies
        setattr(device_arrays, "lend", unowned)
    main(int(sys.argv[1]))
