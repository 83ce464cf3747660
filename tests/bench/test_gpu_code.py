"""`clrt bench gpu-code`: the compilers' outputs are parsed, and kernels past their budgets are found."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from clrt.bench.gpu_code import amd, intel, nvidia, programs, toolchain
from clrt.bench.gpu_code.budgets import Budget, budgets, past_budget
from clrt.bench.gpu_code.kernel_code import KernelCode
from clrt.bench.gpu_code.measure import VENDORS, measure
from clrt.bench.gpu_code.programs import GpuProgram, all_programs
from clrt.cli.bench_gpu_code import gpu_code_command
from clrt.errors import UsageError

NEEDED = pytest.mark.needs("clang-19", "llvm-size-19", "ocloc", "nvidia")

# Of ptxas 13.5, llvm-size 19, clang 19 and ocloc 22.43, for two small kernels and a traversal.
PTXAS = """ptxas info    : 0 bytes gmem
ptxas info    : Compiling entry function 'second' for 'sm_86'
ptxas info    : Function properties for second
    80 bytes stack frame, 8 bytes spill stores, 12 bytes spill loads
ptxas info    : Used 26 registers, used 1 barriers, 88 bytes cumulative stack size, 256 bytes smem, 364 bytes cmem[0]
ptxas info    : Compile time = 14.413 ms
ptxas info    : Compiling entry function 'first' for 'sm_86'
ptxas info    : Function properties for first
    0 bytes stack frame, 0 bytes spill stores, 0 bytes spill loads
ptxas info    : Used 94 registers, used 0 barriers, 372 bytes cmem[0]
ptxas info    : Compile time = 4.242 ms
ptxas info    : Function properties for settle
    0 bytes stack frame, 4 bytes spill stores, 4 bytes spill loads
"""
SECTIONS = """x.cubin  :
section                  size   addr
.nv.constant0.second      364      0
.text.second             2304      0
.text.first              1408      0
Total                    5432
"""
ASSEMBLY = """\t.type\tfirst,@function
first:                                  ; @first
; %bb.0:
\ts_load_dwordx4 s[0:3], s[6:7], 0x0
\tglobal_load_dword v1, v0, s[0:1]
.LBB0_1:                                ; =>This Loop Header: Depth=1
                                        ;     Child Loop BB0_2 Depth 2
\tglobal_load_dwordx4 v[2:5], v0, s[0:1]
\tglobal_load_dwordx4 v[6:9], v0, s[0:1] offset:16
.LBB0_2:                                ;   Parent Loop BB0_1 Depth=1
                                        ; =>  This Inner Loop Header: Depth=2
\tflat_load_dword v10, v[2:3]
\tbuffer_load_dword v11, off, s[0:3], 0
; %bb.3:                                ;   in Loop: Header=BB0_1 Depth=1
\ts_cbranch_scc1 .LBB0_1
; %bb.4:
\tglobal_load_dword v1, v0, s[0:1]
\ts_endpgm
.Lfunc_end0:
\t.amdhsa_kernel first
\t\t.amdhsa_next_free_vgpr 102
\t.end_amdhsa_kernel
; NumVgprs: 102
; Occupancy: 9
\t.amdgpu_metadata
---
amdhsa.kernels:
  - .args:
      - .name:           records
        .offset:         0
    .group_segment_fixed_size: 256
    .max_flat_workgroup_size: 256
    .name:           first
    .private_segment_fixed_size: 560
    .sgpr_spill_count: 3
    .vgpr_count:     102
    .vgpr_spill_count: 2
amdhsa.target:   amdgcn-unknown-amdhsa--gfx1030
amdhsa.version:
  - 1
  - 2
...
\t.end_amdgpu_metadata
"""
OCLOC = """
warning: kernel first  compiled SIMD16 allocated 128 regs and spilled around 63

warning: kernel first  compiled SIMD8 allocated 128 regs and spilled around 20

Build succeeded.
"""
INFO = """---
version:         '1.20'
kernels:
  - name:            first
    execution_env:
      barrier_count:   1
      grf_count:       128
      simd_size:       8
      slm_size:        256
    payload_arguments:
      - arg_type:        global_id_offset
        size:            12
    per_thread_memory_buffers:
      - type:            scratch
        usage:           spill_fill_space
        size:            16384
      - type:            global
        usage:           private_space
        size:            884
        is_simt_thread:  true
  - name:            second
    execution_env:
      grf_count:       128
      simd_size:       16
    per_thread_memory_buffers:
      - type:            scratch
        usage:           single_space
        size:            2048
  - name:            Intel_Symbol_Table_Void_Program
    execution_env:
      grf_count:       128
      simd_size:       8
kernels_misc_info:
  - name:            first
"""


def test_ptxas_is_parsed() -> None:
    """The spills of a function that is not inlined count in each kernel; its stack is in the cumulative one."""
    second, first = nvidia.parsed("sm_86", PTXAS, SECTIONS)
    assert second == KernelCode("sm_86", "second", 26, 8 + 12 + 8, 88, 256, 48, 2304 // 16)
    assert first == KernelCode("sm_86", "first", 94, 8, 0, 0, 20, 1408 // 16)


def test_llvms_assembly_is_parsed() -> None:
    """Loads are counted within loops alone, and not those from the stack."""
    assert amd.parsed("gfx1030", ASSEMBLY) == [KernelCode("gfx1030", "first", 102, 2, 560, 256, 9, 9, 3)]


def test_intels_binary_is_parsed() -> None:
    """Of attempts at several SIMD widths the last one counts; private memory may share a space with spills."""
    words = {".first": [1, 7, 1 | intel.COMPACT, 1, 7, 0, 0], ".second": [1, 7]}
    kernels = intel.parsed("dg2", OCLOC, INFO, lambda name: code(words[f".{name}"]))
    assert kernels == [
        KernelCode("dg2", "first", 128, 20, 884, 256, 8, 3),
        KernelCode("dg2", "second", 128, 0, None, 0, 16, 1),
    ]


def code(words: list[int]) -> bytes:
    """Return instructions whose halves begin with these words."""
    return np.stack([np.array(words, np.uint32), np.full(len(words), 9, np.uint32)], axis=1).tobytes()


@pytest.mark.parametrize(
    ("target", "registers", "warps"),
    [("sm_90", 32, 64), ("sm_86", 32, 48), ("sm_90", 64, 32), ("sm_90", 65, 28), ("sm_75", 96, 20), ("sm_90", 255, 8)],
)
def test_registers_limit_warps(target: str, registers: int, warps: int) -> None:
    """As in the occupancy tables of NVIDIA's CUDA programming guide: 64 Ki registers, given to warps by 256."""
    assert nvidia.warps(target, registers) == warps


KERNEL = KernelCode("gfx1030", "query_any_hit", 96, 0, 112, 0, 10, 700)


def test_a_kernel_past_its_budget_is_found() -> None:
    limits = {"registers": 96, "spills": 0, "private_bytes": 112, "local_bytes": 0, "occupancy": 10}
    table = [Budget("query/*", "*", "gfx*", limits)]
    assert past_budget("query/bvh2", KERNEL, table) == []
    worse = replace(KERNEL, registers=97, spills=1, private_bytes=113, local_bytes=4, occupancy=9)
    assert past_budget("query/bvh2", worse, table) == [
        "registers 97 > 96",
        "spills 1 > 0",
        "private bytes 113 > 112",
        "local bytes 4 > 0",
        "occupancy 9 < 10",
    ]
    assert (
        past_budget("build/bvh2", worse, table) == past_budget("query/bvh2", replace(worse, target="dg2"), table) == []
    )


def test_the_last_row_with_a_limit_counts() -> None:
    general, own = Budget("*", "*", "*", {"registers": 64, "spills": 0}), Budget("query/*", "*", "*", {"registers": 96})
    assert past_budget("query/bvh2", KERNEL, [general, own]) == []
    assert past_budget("query/bvh2", KERNEL, [own, general]) == ["registers 96 > 64"]
    assert past_budget("query/bvh2", replace(KERNEL, spills=1), [general, own]) == ["spills 1 > 0"]


@pytest.fixture(scope="module")
def every() -> list[GpuProgram]:
    return list(all_programs())


def test_each_row_of_the_table_covers_a_kernel(every: list[GpuProgram]) -> None:
    targets = [target for vendor in VENDORS.values() for target in vendor.targets]
    pairs = [(p.name, kernel) for p in every for kernel in re.findall(r"\bkernel void (\w+)", p.source)]
    for row in budgets():
        assert any(fnmatchcase(target, row.target) for target in targets), row
        assert any(fnmatchcase(name, row.program) and fnmatchcase(kernel, row.kernel) for name, kernel in pairs), row


def test_programs_are_those_of_a_gpu(every: list[GpuProgram]) -> None:
    """The gallery is whole, names and texts are distinct, and a work-item has one lane wherever it has a choice."""
    scenes = {path.stem for path in (Path(__file__).parents[2] / "scenes").glob("*.toml")}
    assert len(scenes) == 16 and {f"scene/{name}" for name in scenes} <= {program.name for program in every}
    assert len({program.name for program in every}) == len({program.source for program in every}) == len(every)
    lanes = {p.name: re.findall(r"^#define LANES (\d+)", p.source, re.MULTILINE) for p in every}
    assert {value for found in lanes.values() for value in found} == {"1"}


def test_missing_tools_are_one_error(monkeypatch: pytest.MonkeyPatch) -> None:
    there = {"clang-19", "llvm-size-19"}
    monkeypatch.setattr(toolchain, "find_tool", lambda name: Path(name) if name in there else None)
    with pytest.raises(UsageError) as error:
        list(measure([], ["nvidia", "intel"], True))
    assert "pip install nvidia-cuda-nvcc" in str(error.value) and "apt install intel-opencl-icd" in str(error.value)
    assert str(error.value).count("apt install llvm-19") == 1 and "clang-19" not in str(error.value)


def queries(every: list[GpuProgram]) -> list[GpuProgram]:
    return [program for program in every if program.name in ("query/cwbvh/closest_hit", "refit/bvh2")]


def run(monkeypatch: pytest.MonkeyPatch, chosen: list[GpuProgram], *arguments: str) -> tuple[int, str, str]:
    """Run the command on these programs; return its exit code, table and problems."""

    def these() -> Iterator[GpuProgram]:
        yield from chosen

    monkeypatch.setattr(programs, "all_programs", these)
    done = CliRunner().invoke(gpu_code_command, ["--quick", *arguments], catch_exceptions=False)
    return done.exit_code, done.stdout, done.stderr


@NEEDED
def test_kernels_are_within_their_budgets(every: list[GpuProgram], monkeypatch: pytest.MonkeyPatch) -> None:
    """Each kernel of a program has a line per vendor. What was compiled before is not compiled again."""
    code, table, problems = run(monkeypatch, queries(every))
    assert (code, problems) == (0, "")
    for kernel in ("query_closest_hit", "query_any_hit", "refit_level"):
        assert [line.split()[2] for line in table.splitlines() if f" {kernel} " in line] == ["nvidia", "amd", "intel"]

    def refuse(*arguments: object, **options: object) -> str:
        raise AssertionError(f"{arguments} is run again")

    for module in (nvidia, amd, intel):
        for name in ("assembly", "run_tool"):
            monkeypatch.setattr(module, name, refuse, raising=False)
    assert run(monkeypatch, queries(every)) == (0, table, "")


@NEEDED
def test_a_kernel_fattened_on_purpose_fails(every: list[GpuProgram], monkeypatch: pytest.MonkeyPatch) -> None:
    """An array of a kilobyte per ray, of which the compiler cannot know the index."""
    thin = queries(every)[0]
    start = "uint first = (uint)get_global_id(0) * LANES;"
    fat = f"{start} volatile float fat[256]; fat[count % 256] = unit; fat[first % 256] += unit;"
    head, query, body = thin.source.partition("kernel void query_any_hit")
    assert start in body
    code, _, problems = run(monkeypatch, [GpuProgram(thin.name, head + query + body.replace(start, fat, 1))])
    assert code == 1
    for target in ("sm_86", "gfx1030", "dg2"):
        assert re.search(rf"closest_hit, query_any_hit on {target}: .*private bytes 1\d\d\d > ", problems)
    assert "query_closest_hit on" not in problems


@NEEDED
@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("kernel void k(global int *a) { a[0] = 0b1; }", "binary integer literals"),
        ("kernel void k(global int *a) { int unused; a[0] = b; }", "undeclared identifier 'b'"),
    ],
)
def test_what_does_not_conform_is_a_problem(text: str, problem: str, monkeypatch: pytest.MonkeyPatch) -> None:
    code, _, problems = run(monkeypatch, [GpuProgram("own", text)], "--vendor", "amd")
    assert code == 1 and "own for amd" in problems and problem in problems
