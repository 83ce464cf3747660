"""AMD: LLVM, which is the compiler of its drivers."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from .front_end import assembly
from .kernel_code import KernelCode

LIBRARY = "/usr/lib/clc/amdgcn--amdhsa.bc"
TOOLS = ("clang-19", LIBRARY)
#: CDNA 2, RDNA 2, 3 and 4.
TARGETS = ("gfx90a", "gfx1030", "gfx1100", "gfx1201")
QUICK = "gfx1030"

_METADATA = re.compile(r"^amdhsa\.kernels:\n(.*)^amdhsa\.target:", re.DOTALL | re.MULTILINE)
_OCCUPANCY = re.compile(r"\.amdhsa_kernel (\w+).*?; Occupancy: (\d+)", re.DOTALL)
_INSTRUCTION = re.compile(r"^\t[a-z]\w+")
_LOAD = re.compile(r"^\t(?:global|flat)_load_")
_BLOCK = re.compile(r"^(?:\.LBB|; %bb)")
_LOOP = re.compile(r"in Loop:|Loop Header|Parent Loop")


def compile_program(source: Path, targets: Sequence[str]) -> list[KernelCode]:
    """Compile a program for each target; files are written next to it."""
    return [
        kernel
        for target in targets
        for kernel in parsed(target, assembly(source, "program.s", "amdgcn-unknown-amdhsa", target, LIBRARY))
    ]


def parsed(target: str, text: str) -> list[KernelCode]:
    """Return the kernels in an assembly text."""
    occupancy, metadata = dict(_OCCUPANCY.findall(text)), _METADATA.search(text)
    assert metadata, "LLVM describes no kernels"
    kernels = re.split(r"^  - ", metadata[1], flags=re.MULTILINE)[1:]
    return [_kernel(target, each, occupancy, text) for each in kernels]


def _kernel(target: str, metadata: str, occupancy: dict[str, str], text: str) -> KernelCode:
    def value(key: str) -> str:
        found = re.search(rf"^(?: {{4}})?\.{key}: +(\S+)", metadata, re.MULTILINE)
        assert found, f"LLVM reports no {key}"
        return found[1]

    name = value("name")
    instructions, loop_loads = counted(text, name)
    return KernelCode(
        target,
        name,
        int(value("vgpr_count")),
        int(value("vgpr_spill_count")),
        int(value("private_segment_fixed_size")),
        int(value("group_segment_fixed_size")),
        int(occupancy[name]),
        instructions,
        loop_loads,
    )


def counted(text: str, name: str) -> tuple[int, int]:
    """Return the number of a kernel's instructions, and of those within loops that load from global memory.

    LLVM writes the loop that contains a basic block next to its label, or above a loop's first block, in comments.
    """
    body = re.search(rf"^{name}:(.*?)^\.Lfunc_end", text, re.DOTALL | re.MULTILINE)
    assert body, f"LLVM wrote no code of {name}"
    instructions = loads = 0
    in_loop = False
    for line in body[1].splitlines():
        if _BLOCK.match(line):
            in_loop = False
        in_loop = in_loop or _LOOP.search(line) is not None
        instructions += _INSTRUCTION.match(line) is not None
        loads += in_loop and _LOAD.match(line) is not None
    return instructions, loads
