"""Speed and memory of reading model files, by clrt and the other programs that are installed."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

from .fresh_read import READERS, measure
from .model_files import FILES, grid

#: Python packages of the readers, and those that clrt itself needs for a format.
PACKAGES = {"Open3D": "open3d", "Blender": "bpy"}
NEEDED = {".usdc": "pxr", ".3mf": "lib3mf"}


def measure_reading(triangles: int, rounds: int, names: Sequence[str] = ()) -> Iterator[dict[str, Any]]:
    """Yield for each file of FILES, or those of these names: its file name, bytes, triangles, and `readers` by name.

    These are medians over interleaved rounds, each in a new process: seconds, cpu_seconds, added_bytes (None elsewhere
    than on Linux), triangles; ratio, cpu_ratio: to clrt's. A reader that cannot read the format has the `error` only.
    """
    mesh = grid(triangles)
    readers = [name for name in READERS if find_spec(PACKAGES.get(name, name.lower()))]
    with TemporaryDirectory() as folder:
        for name in names or FILES:
            path = Path(folder) / name
            if (needed := NEEDED.get(path.suffix)) and not find_spec(needed):
                continue
            FILES[name](path, mesh)
            taken = [{reader: _in_new_process(reader, path) for reader in readers} for _ in range(rounds)]
            size = path.stat().st_size
            path.unlink()
            figures = {reader: _medians([each[reader] for each in taken]) for reader in readers}
            for row in figures.values():
                for key, ratio in (("seconds", "ratio"), ("cpu_seconds", "cpu_ratio")):
                    if key in row:
                        row[ratio] = row[key] / figures["clrt"][key]
            yield {"file": name, "bytes": size, "triangles": len(mesh.faces), "readers": figures}


def _in_new_process(reader: str, path: Path) -> dict[str, Any]:
    done = subprocess.run(
        [sys.executable, "-m", measure.__module__, reader, str(path)], text=True, capture_output=True, cwd=path.parent
    )
    lines = (done.stderr if done.returncode else done.stdout).strip().splitlines()
    last = lines[-1] if lines else f"exited with {done.returncode}"
    if done.returncode:
        return {"error": last}
    row: dict[str, Any] = json.loads(last)
    return row if row["triangles"] else {"error": "reads no triangles"}


def _medians(rows: list[dict[str, Any]]) -> dict[str, Any]:
    if errors := [row for row in rows if "error" in row]:
        return errors[0]
    return {key: None if rows[0][key] is None else median(row[key] for row in rows) for key in rows[0]}
