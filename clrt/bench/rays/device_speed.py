"""Ray throughput of a device: primary, bounce and shadow rays are traced for some seconds, in a separate process.

`python -m clrt.bench.rays.device_speed ID` is that process. The scene is a bumpy ball of 49 152 triangles in a room;
the number of rays is chosen to keep the device busy, however fast it is.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict

from ...device.device_info import DeviceInfo, Speed
from ...device.programs.child_process import end_child, last_line, start_child, told_end
from ...errors import DeviceError
from ...queries.mesh import RayQuery
from .ray_speed import Run
from .workloads import Mesh, Workload, bumpy_ball, closed_room, workloads

KINDS = ("primary", "bounce", "shadow")
SUBDIVISIONS = 6
#: Side in pixels of the image whose rays are traced: doubled until its primary rays take BUSY seconds.
SMALLEST, LARGEST, BUSY = 64, 2048, 0.02
#: Seconds for which each kind of rays is traced; the fastest time counts, as the machine may be shared.
MEASURED = 0.3


def measure_device(info: DeviceInfo, limit: float) -> Speed:
    """Measure a device in a child process. Raises DeviceError if it crashes or takes more than `limit` seconds."""
    with tempfile.TemporaryFile() as output, tempfile.TemporaryFile() as errors:
        child = start_child(__name__, info.id, output, errors)
        try:
            code = child.wait(limit)
        except subprocess.TimeoutExpired as error:
            raise DeviceError(f"{info.name} cannot be measured: it did not finish in {limit:g} s") from error
        finally:
            end_child(child)
        if code:
            raise DeviceError(f"{info.name} cannot be measured: {told_end(code)}{last_line(errors)}")
        output.seek(0)
        return Speed(**json.loads(output.read()))


def measure(device: str) -> Speed:
    """Measure a device in this process."""
    ball = bumpy_ball(SUBDIVISIONS)
    room = closed_room(*ball)
    query = RayQuery(*room, device=device)
    side = busy_side(query, room, ball)
    kinds = [kind for kind in workloads(*room, ball[0], query.closest_hit, (side, side)) if kind.name in KINDS]
    return Speed(
        **{f"mrays_{kind.name}": len(kind.rays[2]) / shortest_seconds(query, kind, MEASURED) / 1e6 for kind in kinds}
    )


def busy_side(query: RayQuery, room: Mesh, target: Mesh, largest: int = LARGEST) -> int:
    """Return the side in pixels of a square image whose primary rays keep the device busy, at most `largest`."""
    side = min(SMALLEST, largest)
    while side < largest:
        primary = next(workloads(*room, target[0], query.closest_hit, (side, side)))
        if shortest_seconds(query, primary) >= BUSY:
            break
        side *= 2
    return side


def shortest_seconds(query: RayQuery, kind: Workload, budget: float = 0.0) -> float:
    """Return the shortest kernel time for these rays within `budget` seconds, after a warm-up run."""
    run = Run(query, query.any_hit if kind.any_hit else query.closest_hit, kind.rays)
    end = time.perf_counter() + budget
    shortest = run()[0]
    while time.perf_counter() < end:
        shortest = min(shortest, run()[0])
    return shortest


def main() -> None:
    """Measure the device that the first argument names. What its driver prints goes to standard error."""
    with os.fdopen(os.dup(1), "w", encoding="utf-8") as result:
        os.dup2(2, 1)
        json.dump(asdict(measure(sys.argv[1])), result)


if __name__ == "__main__":
    main()
