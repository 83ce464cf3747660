"""One device with one thread compared with two: same image, and the speedup; also with one failing during the render.

POCL_MAX_PTHREAD_COUNT=1 gives a PoCL one thread, however many devices it has, so two are needed: pip's and the
system's. The figures are meaningful only on a machine with two idle cores.
"""

from __future__ import annotations

import json
import os
import random
import tempfile
from collections.abc import Iterator
from pathlib import Path
from statistics import median

from clrt.output.images import read_image

from ..c_library import compile_library
from ..cli.test_faults import FAULTY, fault
from .renders import CORNELL, GALLERY, finish, start

TURNS, FAILURES = 5, 20
SCENES = [scene for scene in GALLERY if scene.stem in ("cornell", "glass", "spheres", "spot")]
POCL = "Portable Computing Language"
#: The options of "one" and "two", set once the devices are known.
RENDERS: dict[str, tuple[str, ...]] = {}


def trial() -> Iterator[str]:
    import clrt

    found = [device for device in clrt.devices() if device["usable"] and device["platform"] == POCL]
    if len(found) < 2:
        yield "there is one PoCL: OCL_ICD_VENDORS names a folder without the system's, or none is installed"
        return
    RENDERS.update(one=("--device", found[0]["id"]), two=("--device", found[0]["id"], "--device", found[1]["id"]))
    os.environ["POCL_MAX_PTHREAD_COUNT"] = "1"
    yield f"{'scene':12}{'one':>9}{'two':>9}  times as fast"
    for scene in SCENES:
        seconds: dict[str, list[float]] = {name: [] for name in RENDERS}
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            for _ in range(TURNS):
                for kind, devices in RENDERS.items():
                    finish(
                        start(
                            folder,
                            scene,
                            "--size",
                            "512x384",
                            "--spp",
                            64,
                            "-q",
                            "-o",
                            f"{kind}.exr",
                            "--report",
                            f"{kind}.json",
                            *devices,
                        )
                    )
                    seconds[kind].append(json.loads((folder / f"{kind}.json").read_text())["seconds"])
            pictures = [read_image(folder / f"{kind}.exr").tobytes() for kind in RENDERS]
        one, two = (median(seconds[kind]) for kind in RENDERS)
        same = "same picture" if pictures[0] == pictures[1] else "OTHER PICTURE"
        yield f"{scene.stem:12}{one:8.2f}s{two:8.2f}s  {one / two:.2f}, {same}"
    del os.environ["POCL_MAX_PTHREAD_COUNT"]
    yield f"one of two that fails at a random moment: {failing()} of {FAILURES} ended in the same picture"


def failing() -> int:
    """Return how often two devices, of which one is lost or hangs, rendered the image of one device."""
    moments, options = random.Random(2), (CORNELL, "--size", "256x256", "--spp", "64", "-o")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        library = compile_library(FAULTY, folder / "libfaulty.so", "-ldl")
        finish(start(folder, *options, "whole.exr", *RENDERS["one"]))
        whole, same = read_image(folder / "whole.exr").tobytes(), 0
        for number in range(FAILURES):
            faulty = fault(library, ("lost", "endless")[number % 2], number // 2 % 2, moments.randrange(1, 12))
            messages = finish(start(folder, *options, "a.exr", *RENDERS["two"], environment=os.environ | faulty))
            same += "is excluded" in messages and read_image(folder / "a.exr").tobytes() == whole
    return same
