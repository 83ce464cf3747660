"""Front ends of OpenCL C: clang's for every target, and whether a program conforms to version 1.2."""

from __future__ import annotations

from pathlib import Path

from .toolchain import run_tool

TOOLS = ("clang-19",)
LANGUAGE = ["-x", "cl", "-cl-std=CL1.2", "-Xclang", "-finclude-default-header"]


def check_conformance(source: Path) -> None:
    """Raise KernelError for a program with constructs that OpenCL C 1.2 lacks, or that clang warns about."""
    run_tool(
        *TOOLS, *LANGUAGE, "-fsyntax-only", "-pedantic", "-Werror", "-target", "spir64", source.name,
        folder=source.parent,
    )  # fmt: skip


def assembly(source: Path, result: str, triple: str, cpu: str, library: str) -> str:
    """Compile a program, with libclc's functions, to the assembly file `result` next to it; return its text."""
    run_tool(
        *TOOLS, *LANGUAGE, "-O3", "-S", "-target", triple, "-nogpulib", "-Xclang", "-target-cpu", "-Xclang", cpu,
        "-Xclang", "-mlink-builtin-bitcode", "-Xclang", library,
        # libclc 19 declares its functions static, which OpenCL C 1.2 allows as an extension alone.
        "-Dcl_clang_storage_class_specifiers", source.name, "-o", result,
        folder=source.parent,
    )  # fmt: skip
    return (source.parent / result).read_text(encoding="utf-8")
