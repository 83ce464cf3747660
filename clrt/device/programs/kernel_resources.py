"""Registers, spills and memory of kernels, as far as the driver reports them.

Every driver reports private and local memory (clGetKernelWorkGroupInfo). NVIDIA's compiler also writes registers and
spills to the build log, if asked by -cl-nv-verbose (its "OpenCL Programming Guide", and ptxas's -v).
"""

from __future__ import annotations

import re

import pyopencl as cl

from ..open import Device
from .compile_process import quietly_built
from .program import build_options, program_text

VERBOSE = "-cl-nv-verbose"
NVIDIA = "NVIDIA CUDA"
#: Figures of ptxas's log by name.
FIGURES = {
    "registers": r"Used (\d+) registers",
    "stack_bytes": r"(\d+) bytes stack frame",
    "spill_store_bytes": r"(\d+) bytes spill stores",
    "spill_load_bytes": r"(\d+) bytes spill loads",
}


def kernel_resources(device: Device, source: str) -> dict[str, dict[str, int]]:
    """Compile the source, and return for each kernel what the driver reports."""
    options = build_options(device) + [VERBOSE] * (device.info.platform == NVIDIA)
    program = quietly_built(cl.Program(device.context, program_text(device, source)), options)
    log = str(program.get_build_info(device.cl, cl.program_build_info.LOG))  # type: ignore[no-untyped-call]
    told, reported = registers_in(log), cl.kernel_work_group_info
    return {
        kernel.function_name: {
            "private_bytes": kernel.get_work_group_info(reported.PRIVATE_MEM_SIZE, device.cl),
            "local_bytes": kernel.get_work_group_info(reported.LOCAL_MEM_SIZE, device.cl),
            "largest_group": kernel.get_work_group_info(reported.WORK_GROUP_SIZE, device.cl),
            "group_multiple": kernel.get_work_group_info(reported.PREFERRED_WORK_GROUP_SIZE_MULTIPLE, device.cl),
            **told.get(kernel.function_name, {}),
        }
        for kernel in program.all_kernels()
    }


def registers_in(log: str) -> dict[str, dict[str, int]]:
    """Return the FIGURES of each kernel in the log of NVIDIA's compiler, as far as it has them."""
    told: dict[str, dict[str, int]] = {}
    for name, text in re.findall(r"entry function '(\w+)'(.*?)(?=entry function|\Z)", log, re.DOTALL):
        found = {key: re.search(pattern, text) for key, pattern in FIGURES.items()}
        told[name] = {key: int(match[1]) for key, match in found.items() if match}
    return told
