"""The longest launch of any kernel over the gallery, on every device in the environment.

For rusticl set RUSTICL_ENABLE=llvmpipe; for Intel's runtime use an environment that has it. Each scene and device is
a separate process: `python -m tests.trials.launches SCENE DEVICE` prints its figures as JSON. Simulators are skipped.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

from .renders import GALLERY

#: Samples per pixel and seconds, whichever comes first.
SPP, SECONDS = 32, 20.0
#: The kernels that render images.
INTEGRATORS = ("megakernel", "wavefront", "raster")
#: Limit in seconds for a launch on a CPU.
LIMIT = 0.2


def trial() -> Iterator[str]:
    import clrt

    longest = 0.0
    yield f"{'platform':26}{'scene':18}{'launches':>9}{'median':>9}{'longest':>9}  of other kernels"
    for device in clrt.devices():
        if not device["usable"] or device["type"] not in ("cpu", "gpu") or "Oclgrind" in device["platform"]:
            continue
        for scene in GALLERY:
            done = subprocess.run(
                [sys.executable, "-m", __name__, str(scene), device["id"]], capture_output=True, text=True
            )
            if done.returncode:
                yield f"{device['platform'][:25]:26}{scene.stem:18} {done.stderr.strip().splitlines()[-1]}"
                continue
            row = json.loads(done.stdout)
            longest = max(longest, row["longest"], row["other"])
            yield (
                f"{device['platform'][:25]:26}{scene.stem:18}{row['launches']:9}{row['median']:9.3f}"
                f"{row['longest']:9.3f}  {row['other']:.3f} {row['name']}"
            )
    yield f"longest of all {longest:.3f} s, to be at most {LIMIT} s on CPUs"


def measured(scene: str, device: str) -> dict[str, Any]:
    """Return the launches of the integrator, their median and longest, and the longest of other kernels, of one render.

    Times are from the device's clock; if it is unusable, the longest is measured on the host, and the median is 0.
    """
    import pyopencl as cl

    import clrt
    from clrt.device.launches.launch import run_seconds

    launched: list[tuple[str, cl.Event]] = []
    enqueue = cl.enqueue_nd_range_kernel

    def noted(queue: Any, kernel: Any, *arguments: Any, **options: Any) -> cl.Event:
        event = enqueue(queue, kernel, *arguments, **options)
        launched.append((re.sub(r"_[0-9a-f]{32}$", "", kernel.function_name), event))
        return event

    cl.enqueue_nd_range_kernel = noted
    report = clrt.render(clrt.load(scene), device=device, spp=SPP, time=SECONDS).report
    took = [(name, run_seconds(event)) for name, event in launched]
    mine = sorted(seconds for name, seconds in took if name in INTEGRATORS)
    other = max(((seconds, name) for name, seconds in took if name not in INTEGRATORS), default=(0.0, ""))
    return {
        "launches": len(mine),
        "median": mine[len(mine) // 2],
        "other": other[0],
        "name": other[1],
        "longest": max(mine[-1], report["kernel"]["longest_launch_seconds"]),
    }


if __name__ == "__main__":
    print(json.dumps(measured(*sys.argv[1:])))
