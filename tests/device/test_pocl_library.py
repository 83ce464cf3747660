"""Functions of PoCL's library become part of a kernel: a call for every fma would take most of the time."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pyopencl
import pytest

from .test_shared_cache import RENDER, SCENE, surroundings

pytestmark = pytest.mark.processes

#: Triangles that are met sixteen at a time, twice what processors with AVX2 take.
TRIANGLE = "[[mesh]]\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\nfaces = [[0, 1, 2]]\n"


@pytest.fixture(scope="module")
def rendered(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, bytes]:
    """What a first render on the PoCL that pip brings says, and the kernel as that keeps it, a library for ld."""
    folder = tmp_path_factory.mktemp("library")
    (folder / "scene.toml").write_text(SCENE + TRIANGLE)
    pocl = next(Path(pyopencl.__file__).parent.glob(".libs/libpocl*"))
    places = surroundings(HOME=str(folder), CLRT_CACHE_DIR=str(folder / "cache"), OCL_ICD_VENDORS=str(pocl),
                          POCL_CACHE_DIR=str(folder / "kept"))
    done = subprocess.run([*RENDER, "picture.png"], cwd=folder, env=places, capture_output=True, text=True, timeout=200)
    assert done.returncode == 0, done.stderr
    kernel, = (folder / "kept").rglob("wave*.so")
    return done.stderr, kernel.read_bytes()


def test_nothing_of_the_library_is_called(rendered: tuple[str, bytes]) -> None:
    """Its functions are named _cl_…; of those that are called the symbols have the names."""
    _, kernel = rendered
    assert b"pocl_kernel_wave" in kernel
    assert b"_cl_fma" not in kernel and b"_cl_vload8" not in kernel


def test_the_compiler_says_nothing(rendered: tuple[str, bytes]) -> None:
    """It counts its warnings on stderr."""
    said, _ = rendered
    assert "warning" not in said
