"""Intel: the compiler of its driver, by way of SPIR-V."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from .kernel_code import KernelCode
from .toolchain import run_tool

TOOLS = ("ocloc", "llvm-objcopy-19")
#: Xe-LP (integrated), Xe-HPG (Arc), Xe-HPC (data centre).
TARGETS = ("tgllp", "dg2", "pvc")
QUICK = "dg2"
#: The kernel that holds functions which are not inlined.
NO_KERNEL = "Intel_Symbol_Table_Void_Program"
#: Bit of an instruction's first word that marks its compact form, of half the size.
COMPACT = 1 << 29

_SPILLED = re.compile(r"kernel (\w+)\s+compiled SIMD(\d+) allocated \d+ regs and spilled around (\d+)")


def compile_program(source: Path, targets: Sequence[str]) -> list[KernelCode]:
    """Compile a program for each target; files are written next to it."""
    folder, options = source.parent, ["-output_no_suffix", "-options", "-cl-std=CL1.2"]
    run_tool("ocloc", "compile", "-spv_only", "-device", targets[0], "-file", source.name, *options, folder=folder)
    spirv = f"{source.stem}.spv"
    found: list[KernelCode] = []
    for target in targets:
        told = run_tool(
            "ocloc", "compile", "-spirv_input", "-file", spirv, "-device", target, "--format", "zebin",
            "-output", target, *options,
            folder=folder,
        )  # fmt: skip
        info = _section(folder, target, ".ze_info").decode()
        found += parsed(target, told, info, lambda name: _section(folder, target, f".text.{name}"))
    return found


def parsed(target: str, told: str, info: str, code: Callable[[str], bytes]) -> list[KernelCode]:
    """Return the kernels in a binary. told: the compiler's output; info: section .ze_info; code: that of a kernel."""
    spills = {(name, simd): int(count) for name, simd, count in _SPILLED.findall(told)}
    listed = info.partition("\nkernels:")[2].partition("\nkernels_misc_info:")[0]
    kernels = [each.partition("\n")[::2] for each in re.split(r"^  - name: +", listed, flags=re.MULTILINE)[1:]]
    return [_kernel(target, name, text, spills, code) for name, text in kernels if name != NO_KERNEL]


def _kernel(
    target: str, name: str, info: str, spills: Mapping[tuple[str, str], int], code: Callable[[str], bytes]
) -> KernelCode:
    values = dict(re.findall(r"^ {6}(\w+): +(\d+)", info, re.MULTILINE))
    return KernelCode(
        target,
        name,
        int(values["grf_count"]),
        spills.get((name, values["simd_size"]), 0),
        _private_bytes(info),
        int(values.get("slm_size", 0)),
        int(values["simd_size"]),
        instruction_count(code(name)),
    )


def _private_bytes(info: str) -> int | None:
    """Return the private memory per work-item, unless it shares a space with spilled registers (before Xe-HPG)."""
    sizes = dict(re.findall(r"usage: +(\w+_space)\s+size: +(\d+)", info))
    return None if "single_space" in sizes else int(sizes.get("private_space", 0))


def instruction_count(code: bytes) -> int:
    """Return the number of instructions, of 16 bytes or 8, in a kernel's code, up to the zeros that fill it up."""
    words = np.frombuffer(code, np.uint32)[::2].tolist()  # the first word of each half
    count = half = 0
    while half < len(words) and words[half]:
        half += 1 if words[half] & COMPACT else 2
        count += 1
    return count


def _section(folder: Path, binary: str, name: str) -> bytes:
    run_tool("llvm-objcopy-19", f"--dump-section={name}=section", binary, os.devnull, folder=folder)
    return (folder / "section").read_bytes()
