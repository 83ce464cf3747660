"""`clrt bench load`: the files contain the grid, and the figures are of reading them."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from click.testing import CliRunner

from clrt.bench.process_memory import children_peak_bytes, cpu_seconds
from clrt.bench.reading.model_files import FILES, grid
from clrt.bench.reading.read_speed import NEEDED, measure_reading
from clrt.cli.bench_load import load_command
from clrt.formats.models import read_mesh

MESH = grid(60)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.needs(NEEDED[suffix])] if (suffix := Path(name).suffix) in NEEDED else [])
        for name in FILES
    ],
)
def test_files_contain_the_grid(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    FILES[name](path, MESH)
    (mesh,) = read_mesh(path)
    scale = 0.01 if name == "mesh.usdc" else 1  # USD files are in centimeters by default
    np.testing.assert_allclose(mesh.vertices[mesh.faces], scale * MESH.vertices[MESH.faces], atol=1e-6)
    if name in ("corners.obj", "binary.ply", "text.ply", "mesh.glb", "mesh.usdc"):
        assert mesh.normals is not None
        np.testing.assert_allclose(mesh.normals[mesh.faces], MESH.normals[MESH.faces], atol=1e-5)
    if path.suffix not in NEEDED:
        theirs: Any = trimesh.load(path, process=False, force="mesh")
        assert len(theirs.faces) == len(MESH.faces)


def test_figures_of_each_reader(tmp_path: Path) -> None:
    """In megabytes, what is read is added to the memory of a process; trimesh does not read USD."""
    (result,) = measure_reading(200_000, 1, ["binary.stl"])
    assert result["bytes"] == 84 + 50 * result["triangles"] >= 10_000_000
    for name in ("clrt", "trimesh"):
        row = result["readers"][name]
        assert row["triangles"] == result["triangles"] and row["seconds"] > 0 and row["cpu_seconds"] > 0
        assert row["added_bytes"] is None or result["bytes"] < row["added_bytes"] < 20 * result["bytes"]
    assert result["readers"]["clrt"]["ratio"] == result["readers"]["clrt"]["cpu_ratio"] == 1


@pytest.mark.needs("pxr")
def test_formats_that_a_reader_does_not_know() -> None:
    (result,) = measure_reading(100, 1, ["mesh.usdc"])
    assert "usdc" in result["readers"]["trimesh"]["error"] and "seconds" in result["readers"]["clrt"]


def test_table_and_json(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    done = CliRunner().invoke(
        load_command, ["--triangles", "100", "--rounds", "1", "--file", "plain.off", "--json", str(path)]
    )
    assert done.exit_code == 0 and "plain.off: 128 triangles" in done.output, done.output
    assert json.loads(path.read_text())["files"][0]["readers"]["clrt"]["triangles"] == 128
    done = CliRunner().invoke(load_command, ["--file", "a.obj"])
    assert done.exit_code == 2 and "plain.off" in done.output


@pytest.mark.skipif(sys.platform != "linux", reason="/proc")
def test_child_processes_count() -> None:
    before = cpu_seconds()
    work = "import time\nwhile time.process_time() < 0.5: pass\nprint(len(b'a' * 50_000_000), flush=True)\ninput()"
    with subprocess.Popen(
        [sys.executable, "-c", work], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout is not None
        child.stdout.readline()
        taken, peak = cpu_seconds() - before, children_peak_bytes()
        child.communicate("\n")
    assert taken > 0.45 and peak > 50_000_000


def test_peak_of_memory_is_what_was_touched_at_a_time() -> None:
    """In a separate process: allocates 200 MB twice, one after the other."""
    program = """
import numpy
from clrt.bench.process_memory import peak_bytes
peaks = [peak_bytes()]
for _ in range(2):
    numpy.ones(25_000_000)
    peaks.append(peak_bytes())
print(*peaks)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    before, once, twice = map(int, done.stdout.split())
    assert before < 2e8 < once < before + 3e8 and twice < once + 1e8
