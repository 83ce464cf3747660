"""Programs built from PoCL's cached bitcode: each from its own, compiled once."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyopencl
import pytest

from clrt.device.open import Device
from clrt.device.pocl.cpu_name import best_processor, processor_flags
from clrt.device.pocl.kernel_cache import BITCODE
from clrt.device.programs import program
from clrt.device.programs.bitcode import find_bitcode, name_kernels, takes_bitcode
from clrt.device.programs.program import program_key
from clrt.output.images import read_image

from .test_shared_cache import RENDER, SCENE, surroundings

#: Builds two programs with equal kernel names; prints their keys, whether they were cached, and their results for 1.
BUILD = """
import json
import numpy as np
import pyopencl as cl
from clrt.device.open import open_device
from clrt.device.programs.program import build, make_kernel

def multiplied(factor):
    built = build(device, "kernel void multiply(global float *x) { x[get_global_id(0)] *= %d; }" % factor)
    x = np.ones(3, np.float32)
    buffer = cl.Buffer(device.context, cl.mem_flags.COPY_HOST_PTR, hostbuf=x)
    make_kernel(device, built, "multiply")(device.queue, (3,), (1,), buffer)
    cl.enqueue_copy(device.queue, x, buffer)
    return list(device.shared.programs)[-1], built.cached, x.tolist()

device = open_device()
print(json.dumps([multiplied(2), multiplied(3)]))
"""
POCL = next(Path(pyopencl.__file__).parent.glob(".libs/libpocl*"))  # installed by pip


def places(folder: Path) -> dict[str, str]:
    return surroundings(
        HOME=str(folder),
        CLRT_CACHE_DIR=str(folder / "cache"),
        POCL_CACHE_DIR=str(folder / "kept"),
        OCL_ICD_VENDORS=str(POCL),
    )


def built(folder: Path) -> tuple[list[str], list[bool], list[list[float]]]:
    done = subprocess.run([sys.executable, "-c", BUILD], env=places(folder), capture_output=True, text=True, check=True)
    keys, cached, values = zip(*json.loads(done.stdout))
    return list(keys), list(cached), list(values)


def test_a_program_is_built_of_its_bitcode(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Kernels are compiled only once; kernels of equal name in different programs are not confused."""
    keys, cached, values = built(tmp_path)
    assert cached == [False, False] and values == [[2, 2, 2], [3, 3, 3]]
    kernels = {file: file.stat().st_mtime_ns for file in (tmp_path / "kept").rglob("*.so")}
    assert len(kernels) == 2
    assert built(tmp_path) == (keys, [True, True], values)
    assert {file: file.stat().st_mtime_ns for file in (tmp_path / "kept").rglob("*.so")} == kernels
    monkeypatch.setenv("POCL_CACHE_DIR", str(tmp_path / "kept"))
    for key in keys:
        found = find_bitcode(f"_{key[:32]}")
        assert found is not None and found[:4] == BITCODE
        assert (tmp_path / "cache" / f"{key}.bin").read_bytes()[32:] == found
    assert find_bitcode("_" + "0" * 32) is None
    monkeypatch.setenv("POCL_CACHE_DIR", str(tmp_path / "absent"))
    assert find_bitcode(f"_{keys[0][:32]}") is None


@pytest.mark.programs
def test_without_pocl_s_files_a_program_is_built_of_its_source(tmp_path: Path) -> None:
    """If PoCL's files are missing, bitcode in clrt's cache is still used."""
    keys, _, values = built(tmp_path)
    (tmp_path / "kept").rename(tmp_path / "away")
    assert built(tmp_path) == (keys, [True, True], values)
    (tmp_path / "cache" / f"{keys[0]}.bin").unlink()
    (tmp_path / "kept").rename(tmp_path / "elsewhere")
    assert built(tmp_path) == (keys, [False, True], values)


@pytest.mark.programs
def test_pictures_are_the_same_of_bitcode(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(SCENE)
    for picture in ("first.exr", "again.exr"):
        subprocess.run([*RENDER, picture], cwd=tmp_path, env=places(tmp_path), check=True, capture_output=True)
    assert np.array_equal(read_image(tmp_path / "again.exr"), read_image(tmp_path / "first.exr"))


@pytest.mark.parametrize("flags", ["avx2 fma bmi1 bmi2 f16c movbe", "sse4_2 popcnt", ""])
def test_machines_of_other_instructions_have_other_programs(
    device: Device, monkeypatch: pytest.MonkeyPatch, flags: str
) -> None:
    """Applies even if processors have the same name, as under hypervisors, and share a cache."""
    here, same = program_key(device, ""), best_processor(set(flags.split())) == best_processor(processor_flags())
    monkeypatch.setattr(program, "processor_flags", lambda: frozenset(flags.split()))
    assert (program_key(device, "") == here) == same


def test_versions_that_crash_on_bitcode_are_given_none() -> None:
    assert takes_bitcode("OpenCL 3.0 PoCL 3.0-rc2  Linux, Release, RELOC, LLVM 14.0.6, SLEEF, DISTRO, POCL_DEBUG")
    assert not takes_bitcode("OpenCL 3.0 PoCL 3.1+debian  Linux, None+Asserts, RELOC, SPIR, LLVM 15.0.6")


def test_kernels_are_named() -> None:
    """Only kernels are renamed, not the functions that they call."""
    source = "void one() {}\n__attribute__((vec_type_hint(int)))\nkernel void two(int two) { one(); }\nkernel void x()"
    named = source.replace("kernel void two(", "kernel void two_ab(").replace("x()", "x_ab()")
    assert name_kernels(source, "_ab") == named
