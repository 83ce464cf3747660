"""CPU time and memory of a process for a model of 1.6 million triangles, and for compilation."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from clrt.bench.process_memory import peak_bytes
from clrt.bench.rays.cold_start import CACHES
from clrt.bench.rays.resize import resized
from clrt.bench.rays.workloads import bumpy_ball

TRIANGLES = 1_600_000
#: Each part includes the work since the previous one.
PARTS = ("import", "load", "tree, records", "program, upload", "a sample")


def trial() -> Iterator[str]:
    with tempfile.TemporaryDirectory() as folder:
        model = Path(folder) / "large.ply"
        write_ply(model, TRIANGLES)
        yield f"{TRIANGLES} triangles, {model.stat().st_size / 1e6:.0f} MB; processor seconds, peak of memory"
        yield f"{'programs':10}" + "".join(f"{part:>20}" for part in PARTS)
        caches = os.environ | dict.fromkeys(CACHES, folder)
        for programs in ("compiled", "kept"):
            done = subprocess.run([sys.executable, "-m", __name__, model], env=caches, check=True, capture_output=True)
            yield f"{programs:10}" + "".join(
                f"{seconds:9.2f} s{peak / 1e6:6.0f} MB" for seconds, peak in json.loads(done.stdout)
            )


def write_ply(file: Path, triangles: int) -> None:
    """Write a binary .ply with slightly more than this number of triangles."""
    vertices, corners = resized(*bumpy_ball(), triangles)
    faces = np.zeros(len(corners), [("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, corners
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {len(vertices)}",
        *(f"property float {axis}" for axis in "xyz"),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "end_header\n",
    ]
    file.write_bytes("\n".join(header).encode() + vertices.astype("<f4").tobytes() + faces.tobytes())


def measure(model: str) -> Iterator[tuple[float, int | None]]:
    """Yield for each of PARTS its seconds of CPU time and the peak memory of the process so far."""
    begun = 0.0

    def lap() -> tuple[float, int | None]:
        nonlocal begun
        before, begun = begun, time.process_time()
        return begun - before, peak_bytes()

    import clrt
    from clrt.rendering.renderer import Renderer

    yield lap()
    scene = clrt.load(model)
    yield lap()
    laps = []
    renderer = Renderer(scene, on_phase=lambda phase: laps.append(lap()))
    yield laps[0][0] + laps[1][0], laps[1][1]
    yield lap()
    for _ in renderer.passes(spp=1):
        pass
    yield lap()


if __name__ == "__main__":
    print(json.dumps(list(measure(sys.argv[1]))))
