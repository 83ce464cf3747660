"""`clrt bench gpu-code`: what the code generators of GPU vendors make of the kernels."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .bench_files import figures_options, write_figures
from .option_types import OneOf

if TYPE_CHECKING:
    from ..bench.gpu_code.kernel_code import KernelCode
    from ..bench.gpu_code.measure import ProgramCode

NAMES = ("nvidia", "amd", "intel")
#: Columns of the table that show each target, and those that show the largest value: title, field of KernelCode, width.
EACH = (("registers", "registers", 17), ("occupancy", "occupancy", 13))
LARGEST = (
    ("spills", "spills", 8),
    ("private", "private_bytes", 9),
    ("local", "local_bytes", 8),
    ("instructions", "instructions", 14),
    ("loads", "loop_loads", 7),
)


@click.command("gpu-code")
@click.option(
    "--vendor", "vendors", multiple=True, type=OneOf(NAMES), help="Vendor whose compiler is used; default: all."
)
@click.option(
    "--scene",
    "scenes",
    multiple=True,
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Only the program of this scene file; default: the gallery, and all other programs.",
)
@click.option("--quick", is_flag=True, help="Use one chip per vendor (sm_86, gfx1030, dg2) instead of all.")
@figures_options
def gpu_code_command(vendors: tuple[str, ...], scenes: tuple[Path, ...], quick: bool, json_file: Path | None) -> None:
    """Compile the kernels for GPUs of three vendors, on a machine without one, and compare with budgets.

    NVIDIA's code is that of clang and of NVIDIA's assembler ptxas (pip install nvidia-cuda-nvcc), AMD's that of LLVM,
    which is AMD's compiler (apt install clang-19 llvm-19 libclc-19), Intel's that of Intel's compiler (apt install
    intel-opencl-icd). Every program must also conform to OpenCL C 1.2 without a warning of clang. Results are cached.

    The exit code is 1 if a program does not compile, or a kernel is past its budget (clrt/bench/gpu_code/budgets.csv).
    """
    from ..bench.gpu_code.measure import VENDORS, measure
    from ..bench.gpu_code.programs import all_programs, scene_programs

    chosen = vendors or NAMES
    programs = scene_programs(scenes) if scenes else all_programs()
    click.echo("\n".join(_head({name: _targets(VENDORS[name].quick, VENDORS[name].targets, quick) for name in chosen})))
    rows: list[dict[str, Any]] = []
    problems: list[str] = []
    for code in measure(programs, chosen, quick):
        for line in _lines(code):
            click.echo(line)
        rows += [{"program": code.program, "vendor": code.vendor, **asdict(kernel)} for kernel in code.kernels]
        problems += _problems(code)
    write_figures(json_file, {"kernels": rows, "problems": problems})
    for problem in problems:
        click.echo(problem, err=True)
    if problems:
        raise SystemExit(1)


def _targets(quick_target: str, targets: Sequence[str], quick: bool) -> Sequence[str]:
    return (quick_target,) if quick else targets


def _head(targets: dict[str, Sequence[str]]) -> list[str]:
    titles = "".join(f"{title:{width}}" for title, _, width in EACH)
    titles += "".join(f"{title:>{width}}" for title, _, width in LARGEST)
    return [
        *(f"{name}: {', '.join(chips)}" for name, chips in targets.items()),
        "  registers, occupancy: of each in this order, or one number for all; the other columns: the largest value",
        "  occupancy: warps per multiprocessor (nvidia), waves per SIMD unit (amd), SIMD width (intel)",
        "  spills: bytes stored and loaded (nvidia), registers (amd), instructions (intel)",
        "  private, local: bytes per work-item and work-group; loads: from global memory, in loops (amd)",
        f"{'program':24}{'kernel':20}{'':8}{titles}",
    ]


def _lines(code: ProgramCode) -> Iterator[str]:
    for name in dict.fromkeys(kernel.kernel for kernel in code.kernels):
        own = [kernel for kernel in code.kernels if kernel.kernel == name]
        cells = "".join(f"{_each(own, field):{width}}" for _, field, width in EACH)
        cells += "".join(f"{_largest(own, field):>{width}}" for _, field, width in LARGEST)
        yield f"{code.program:24}{name:20}{code.vendor:8}{cells}".rstrip()


def _each(kernels: Iterable[KernelCode], field: str) -> str:
    values = [str(getattr(kernel, field)) for kernel in kernels]
    return values[0] if len(set(values)) == 1 else " ".join(values)


def _largest(kernels: Iterable[KernelCode], field: str) -> str:
    values = [value for kernel in kernels if (value := getattr(kernel, field)) is not None]
    return str(max(values)) if values else ""


def _problems(code: ProgramCode) -> Iterator[str]:
    from ..bench.gpu_code.budgets import past_budget

    if code.problem:
        yield f"{code.program} for {code.vendor}: {code.problem}"
    for kernel in code.kernels:
        if over := past_budget(code.program, kernel):
            yield f"{code.program}, {kernel.kernel} on {kernel.target}: {', '.join(over)}"
