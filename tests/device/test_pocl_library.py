"""Functions of PoCL's library are inlined into kernels: a call per fma would take most of the time."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pyopencl
import pytest

from .test_shared_cache import RENDER, SCENE, surroundings

pytestmark = pytest.mark.processes

#: Triangles are intersected sixteen at a time, twice the SIMD width of AVX2.
TRIANGLE = "[[mesh]]\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\nfaces = [[0, 1, 2]]\n"


@pytest.fixture(scope="module")
def rendered(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, bytes]:
    """Return stderr of a first render on pip's PoCL, and the cached kernel, a shared library for ld."""
    folder = tmp_path_factory.mktemp("library")
    (folder / "scene.toml").write_text(SCENE + TRIANGLE)
    pocl = next(Path(pyopencl.__file__).parent.glob(".libs/libpocl*"))
    places = surroundings(
        HOME=str(folder),
        CLRT_CACHE_DIR=str(folder / "cache"),
        OCL_ICD_VENDORS=str(pocl),
        POCL_CACHE_DIR=str(folder / "kept"),
    )
    done = subprocess.run([*RENDER, "picture.png"], cwd=folder, env=places, capture_output=True, text=True, timeout=200)
    assert done.returncode == 0, done.stderr
    (kernel,) = (folder / "kept").rglob("wave*.so")
    return done.stderr, kernel.read_bytes()


def test_nothing_of_the_library_is_called(rendered: tuple[str, bytes]) -> None:
    """The library's functions are named _cl_…; those that are called have symbols of that name."""
    _, kernel = rendered
    assert b"pocl_kernel_wave" in kernel
    assert b"_cl_fma" not in kernel and b"_cl_vload8" not in kernel


def test_the_compiler_says_nothing(rendered: tuple[str, bytes]) -> None:
    """The compiler would count its warnings on stderr."""
    said, _ = rendered
    assert "warning" not in said
