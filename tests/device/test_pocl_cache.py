"""Damaged files in PoCL's cache, as after a full disk or a power failure."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pyopencl
import pytest

from clrt.device.pocl.kernel_cache import remove_damaged
from clrt.output.images import read_image

from .test_shared_cache import RENDER, SCENE, surroundings

pytestmark = pytest.mark.processes

GARBAGE = bytes(range(256)) * 4


@pytest.mark.parametrize("name, size", [("program.bc", 0), ("program.bc", 1000), ("*.so", 0), ("*.so", 1000)])
def test_a_damaged_program_is_compiled_again(tmp_path: Path, name: str, size: int) -> None:
    """Some damage is noticed at once; if PoCL aborts on it, the error says so and the damaged files are removed."""
    (tmp_path / "scene.toml").write_text(SCENE)
    pocl = next(Path(pyopencl.__file__).parent.glob(".libs/libpocl*"))  # installed by pip
    places = surroundings(
        HOME=str(tmp_path),
        CLRT_CACHE_DIR=str(tmp_path / "cache"),
        OCL_ICD_VENDORS=str(pocl),
        POCL_CACHE_DIR=str(tmp_path / "kept"),
    )

    def rendered(picture: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([*RENDER, picture], cwd=tmp_path, env=places, capture_output=True, text=True, timeout=200)

    assert rendered("whole.exr").returncode == 0
    files = list((tmp_path / "kept").rglob(name))
    assert files
    for file in files:
        file.write_bytes(GARBAGE[:size])
    first = rendered("first.exr")
    assert first.returncode == 0 or (
        first.returncode == 4 and f"because {len(files)} of the programs that PoCL caches" in first.stderr
    ), first.stderr
    assert rendered("second.exr").returncode == 0
    assert np.array_equal(read_image(tmp_path / "second.exr"), read_image(tmp_path / "whole.exr"))


def test_whole_programs_stay(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Intact programs, files outside a program's folder, and missing folders are left alone."""
    monkeypatch.setenv("POCL_CACHE_DIR", str(tmp_path / "absent"))
    assert remove_damaged() == 0
    program = tmp_path / "AB" / "CDE"
    program.mkdir(parents=True)
    (program / "program.bc").write_bytes(b"BC\xc0\xde" + GARBAGE)
    monkeypatch.setenv("POCL_CACHE_DIR", str(tmp_path))
    assert remove_damaged() == 0 and program.is_dir()
    (program / "program.bc").write_bytes(b"BC")
    assert remove_damaged() == 1 and not program.exists()
