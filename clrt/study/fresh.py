"""What a new process pays, from arrays to first answers: seconds, kernels' building included, and its peak of memory.

`python -m clrt.study.fresh FOLDER` is that process: it answers what `measure_fresh` has put into the folder.
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

from ..errors import ClrtError
from ..query import RayQuery
from .rays import Rays
from .workloads import Mesh

ARRAYS, OPTIONS, FIGURES = "arrays.npz", "options.json", "figures.json"
#: Where programs are kept: clrt's own cache and PoCL's.
CACHES = ("CLRT_CACHE_DIR", "POCL_CACHE_DIR")


def measure_fresh(scene: Mesh, rays: Rays, cache: Path | None = None, **options: Any) -> dict[str, Any]:
    """The figures of a new process that builds the tree and asks for the closest hits. options: see RayQuery.

    build_seconds: from arrays to the tree on the device; tree_seconds: of the tree; answer_seconds: of the first call;
    hits; peak_bytes: the most memory that the process had. cache: a folder to keep programs in, which an empty one
    must be compiled for; left out, the user's.
    """
    with TemporaryDirectory() as folder:
        np.savez(Path(folder) / ARRAYS, *scene, *rays)
        (Path(folder) / OPTIONS).write_text(json.dumps(options))
        caches = {} if cache is None else dict.fromkeys(CACHES, str(cache))
        done = subprocess.run([sys.executable, "-m", __name__, folder], env=os.environ | caches, text=True,
                              capture_output=True)
        if done.returncode:
            raise ClrtError(f"a new process that builds a tree ended with {done.returncode}: {done.stderr.strip()}")
        figures: dict[str, Any] = json.loads((Path(folder) / FIGURES).read_text())
        return figures


def answer(folder: Path) -> None:
    """What the new process does."""
    with np.load(folder / ARRAYS) as stored:
        vertices, faces, *rays = (stored[name] for name in stored.files)
    start = time.perf_counter()
    query = RayQuery(vertices, faces, **json.loads((folder / OPTIONS).read_text()))
    built = time.perf_counter()
    hits = query.closest_hit(*rays)
    figures = {"build_seconds": built - start, "tree_seconds": query.tree.build_seconds,
               "answer_seconds": time.perf_counter() - built, "hits": int(np.sum(hits["primitive"] >= 0)),
               "peak_bytes": peak_bytes()}
    (folder / FIGURES).write_text(json.dumps(figures))


def peak_bytes() -> int | None:
    """The most memory that this process had at a time; None where the system does not say.

    Linux says more of it in /proc than by getrusage, which counts what the parent had as well.
    """
    try:
        lines = Path("/proc/self/status").read_text().splitlines()
        return next(1024 * int(line.split()[1]) for line in lines if line.startswith("VmHWM:"))
    except (OSError, StopIteration):
        pass
    try:
        from resource import RUSAGE_SELF, getrusage
    except ImportError:
        return None
    return getrusage(RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


if __name__ == "__main__":
    answer(Path(sys.argv[1]))
