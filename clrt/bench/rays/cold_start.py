"""Cold-start cost of a new process, from arrays to first results: seconds including compilation, and peak memory.

`python -m clrt.bench.rays.cold_start FOLDER` is that process: it answers the query that `measure_fresh` stored in the
folder.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from ...errors import ClrtError
from ...queries.mesh import RayQuery
from ..process_memory import peak_bytes
from .ray_speed import Rays
from .workloads import Mesh

ARRAYS, OPTIONS, FIGURES = "arrays.npz", "options.json", "figures.json"
#: Environment variables of the program caches: clrt's own and PoCL's.
CACHES = ("CLRT_CACHE_DIR", "POCL_CACHE_DIR")


def measure_fresh(scene: Mesh, rays: Rays, cache: Path | None = None, **options: Any) -> dict[str, Any]:
    """Measure a new process that builds the BVH and finds the closest hits. options: see RayQuery.

    build_seconds: from arrays to the BVH on the device; tree_seconds: of the BVH build alone; answer_seconds: of the
    first call; hits; peak_bytes: the process's peak memory. cache: the folder of the program caches; if empty, programs
    are compiled; if left out, the user's caches are used.
    """
    with TemporaryDirectory() as folder:
        np.savez(Path(folder) / ARRAYS, *scene, *rays)
        (Path(folder) / OPTIONS).write_text(json.dumps(options))
        caches = {} if cache is None else dict.fromkeys(CACHES, str(cache))
        done = subprocess.run(
            [sys.executable, "-m", __name__, folder], env=os.environ | caches, text=True, capture_output=True
        )
        if done.returncode:
            raise ClrtError(f"a new process that builds a BVH exited with {done.returncode}: {done.stderr.strip()}")
        figures: dict[str, Any] = json.loads((Path(folder) / FIGURES).read_text())
        return figures


def answer(folder: Path) -> None:
    """Run the query in the new process."""
    with np.load(folder / ARRAYS) as stored:
        vertices, faces, *rays = (stored[name] for name in stored.files)
    start = time.perf_counter()
    query = RayQuery(vertices, faces, **json.loads((folder / OPTIONS).read_text()))
    built = time.perf_counter()
    hits = query.closest_hit(*rays)
    figures = {
        "build_seconds": built - start,
        "tree_seconds": query.tree.build_seconds,
        "answer_seconds": time.perf_counter() - built,
        "hits": int(np.sum(hits["primitive"] >= 0)),
        "peak_bytes": peak_bytes(),
    }
    (folder / FIGURES).write_text(json.dumps(figures))


if __name__ == "__main__":
    answer(Path(sys.argv[1]))
