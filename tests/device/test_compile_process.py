"""Compilation in a separate process, for large data on PoCL, gives the same programs and errors."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pyopencl
import pytest

from clrt.device.open import Device
from clrt.device.programs.compile_process import LARGE, compile_aside
from clrt.device.programs.program import OPTIONS, build, make_kernel
from clrt.errors import KernelError

from .test_shared_cache import surroundings

pytestmark = pytest.mark.processes

#: Builds a program of half the renderer for given data bytes; prints peak memory, cache use and number of kernels.
BUILD = """
import json, sys
from clrt.accel.device_builder import SHAPES, program_source
from clrt.device.open import open_device
from clrt.device.programs.program import build
from clrt.bench.process_memory import peak_bytes

built = build(open_device(), program_source(SHAPES["bvh8"], True, False, False), int(sys.argv[1]))
print(json.dumps([peak_bytes(), built.cached, built.program.num_kernels]))
"""
SOURCE = "kernel void add_%d(global float *x) { x[get_global_id(0)] += %d; }"


def test_beside_large_data_no_compiler_takes_memory(tmp_path: Path) -> None:
    """The compiler's 80 MB and more are used by the other process, and the next process finds the program cached."""
    pocl = next(Path(pyopencl.__file__).parent.glob(".libs/libpocl*"))  # installed by pip

    def built(data_bytes: int, kept: str) -> tuple[int, bool, int]:
        folder = str(tmp_path / kept)
        places = surroundings(
            HOME=str(tmp_path), CLRT_CACHE_DIR=folder, POCL_CACHE_DIR=folder, OCL_ICD_VENDORS=str(pocl)
        )
        done = subprocess.run(
            [sys.executable, "-c", BUILD, str(data_bytes)],
            cwd=tmp_path,
            env=places,
            timeout=200,
            capture_output=True,
            text=True,
            check=True,
        )
        peak, cached, kernels = json.loads(done.stdout)
        return peak, cached, kernels

    here, aside = built(LARGE - 1, "here"), built(LARGE, "aside")
    assert here[1:] == aside[1:] and not here[1] and here[2] > 10
    assert here[0] - aside[0] > 60e6
    for kept in ("here", "aside"):
        peak, cached, kernels = built(0, kept)
        assert cached and kernels == here[2] and peak == pytest.approx(aside[0], rel=0.1)


def test_programs_are_refused_as_ever(device: Device) -> None:
    with pytest.raises(KernelError, match="undeclared_name"):
        build(device, "kernel void wrong(global int *x) { x[0] = undeclared_name; }", LARGE)


@pytest.mark.parametrize("number, python, seconds", [(1, "/no/such/python", 60.0), (2, sys.executable, 0.0)])
def test_without_the_other_process_programs_are_compiled_here(
    device: Device, monkeypatch: pytest.MonkeyPatch, number: int, python: str, seconds: float
) -> None:
    """Compiles in this process if the other cannot be started or times out."""
    source = SOURCE % (number, number)
    monkeypatch.setattr(sys, "executable", python)
    compile_aside(device.info.id, source, OPTIONS, seconds)
    make_kernel(device, build(device, source, LARGE), f"add_{number}")
