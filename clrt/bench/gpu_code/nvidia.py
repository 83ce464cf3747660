"""NVIDIA: clang in place of the driver's front end, and the assembler of its drivers, which allocates registers."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from .front_end import assembly
from .kernel_code import KernelCode
from .toolchain import run_tool

LIBRARY = "/usr/lib/clc/nvptx64--nvidiacl.bc"
TOOLS = ("clang-19", "ptxas", "llvm-size-19", LIBRARY)
#: Warps that a multiprocessor can hold, by architecture: Turing, Ampere, Hopper, Blackwell.
MOST_WARPS = {"sm_75": 32, "sm_86": 48, "sm_90": 64, "sm_120": 48}
QUICK = "sm_86"
#: Registers of each quarter of a multiprocessor, and the unit in which a warp's are allocated.
QUARTER, UNIT = 16384, 256
WARP, INSTRUCTION_BYTES = 32, 16
#: All architectures run PTX of the oldest one, which the assembler translates.
OLDEST = "sm_75"

_FUNCTION = re.compile(
    r"Function properties for (\w+)\s+(\d+) bytes stack frame, (\d+) bytes spill stores, (\d+) bytes spill loads"
)
_ENTRY = re.compile(r"Compiling entry function '(\w+)'")
_USED = re.compile(r"Used (\d+) registers(.*)")
_SECTION = re.compile(r"^\.text\.(\w+)\s+(\d+)", re.MULTILINE)


def compile_program(source: Path, targets: Sequence[str]) -> list[KernelCode]:
    """Compile a program for each target; files are written next to it."""
    assembly(source, "program.ptx", "nvptx64-unknown-nvidiacl", OLDEST, LIBRARY)
    found: list[KernelCode] = []
    for target in targets:
        told = run_tool("ptxas", "-v", f"-arch={target}", "program.ptx", "-o", "program.cubin", folder=source.parent)
        found += parsed(target, told, run_tool("llvm-size-19", "-A", "program.cubin", folder=source.parent))
    return found


def parsed(target: str, told: str, sections: str) -> list[KernelCode]:
    """Return the kernels in the output of `ptxas -v` and of `llvm-size -A`.

    Functions that are not inlined are listed once: their spills count in every kernel.
    """
    entries = _ENTRY.split(told)[1:]
    names, texts = entries[::2], entries[1::2]
    functions = {name: tuple(map(int, values)) for name, *values in _FUNCTION.findall(told)}
    called = sum(sum(values[1:]) for name, values in functions.items() if name not in names)
    size = {name: int(count) for name, count in _SECTION.findall(sections)}
    return [_kernel(target, name, text, functions[name], called, size[name]) for name, text in zip(names, texts)]


def _kernel(target: str, name: str, text: str, own: tuple[int, ...], called: int, size: int) -> KernelCode:
    used = _USED.search(text)
    assert used, f"ptxas reports no registers of {name}"
    registers, rest = int(used[1]), used[2]
    stack, *spills = own
    return KernelCode(
        target,
        name,
        registers,
        spills=sum(spills) + called,
        private_bytes=max(stack, _bytes("cumulative stack size", rest)),
        local_bytes=_bytes("smem", rest),
        occupancy=warps(target, registers),
        instructions=size // INSTRUCTION_BYTES,
    )


def warps(target: str, registers: int) -> int:
    """Return how many warps of this many registers per work-item a multiprocessor holds."""
    per_warp = -(-registers * WARP // UNIT) * UNIT
    return min(MOST_WARPS[target], 4 * (QUARTER // per_warp)) if registers else MOST_WARPS[target]


def _bytes(what: str, text: str) -> int:
    found = re.search(rf"(\d+) bytes {what}", text)
    return int(found[1]) if found else 0
