"""Compile programs for several vendors' targets on all cores; results are cached by program and compilers."""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path

from ...device.cache_files import read_file, write_file
from ...errors import KernelError
from . import amd, front_end, intel, nvidia
from .kernel_code import KernelCode
from .programs import GpuProgram
from .toolchain import require_tools, tool_version


@dataclass(frozen=True)
class Vendor:
    """A vendor's compiler. targets: its chips; quick: the one that stands for all; tools: what it needs."""

    targets: tuple[str, ...]
    quick: str
    tools: tuple[str, ...]
    compile_program: Callable[[Path, Sequence[str]], list[KernelCode]]


VENDORS = {
    "nvidia": Vendor(tuple(nvidia.MOST_WARPS), nvidia.QUICK, nvidia.TOOLS, nvidia.compile_program),
    "amd": Vendor(amd.TARGETS, amd.QUICK, amd.TOOLS, amd.compile_program),
    "intel": Vendor(intel.TARGETS, intel.QUICK, intel.TOOLS, intel.compile_program),
}


@dataclass(frozen=True)
class ProgramCode:
    """A program by one vendor's compiler: its kernels, or why it does not compile."""

    program: str
    vendor: str
    kernels: list[KernelCode]
    problem: str = ""


def measure(programs: Iterable[GpuProgram], vendors: Sequence[str], quick: bool) -> Iterator[ProgramCode]:
    """Yield the code of each program by each vendor in order. Raises UsageError if a tool is missing.

    quick: for one target per vendor.
    """
    require_tools(tool for name in vendors for tool in (*front_end.TOOLS, *VENDORS[name].tools))
    with ThreadPoolExecutor(os.cpu_count()) as threads:
        jobs = [threads.submit(_compiled, program, vendor, quick) for program in programs for vendor in vendors]
        try:
            yield from (job.result() for job in jobs)
        finally:
            threads.shutdown(cancel_futures=True)


def _compiled(program: GpuProgram, name: str, quick: bool) -> ProgramCode:
    vendor = VENDORS[name]
    targets = (vendor.quick,) if quick else vendor.targets
    key = _key(program.source, name, targets, vendor.tools)
    if (kept := _kept(key)) is None:
        try:
            with tempfile.TemporaryDirectory() as folder:
                source = Path(folder) / "program.txt"
                source.write_text(program.source, encoding="utf-8")
                front_end.check_conformance(source)
                kept = vendor.compile_program(source, targets)
        except KernelError as error:
            return ProgramCode(program.name, name, [], str(error))
        write_file(key, json.dumps([asdict(kernel) for kernel in kept]).encode())
    return ProgramCode(program.name, name, kept)


def _key(source: str, vendor: str, targets: Sequence[str], tools: Sequence[str]) -> str:
    """Return the name of the file that caches a result, which depends on how the compilers are called as well."""
    digest = hashlib.sha256()
    for part in (source, vendor, *targets, *map(tool_version, (*front_end.TOOLS, *tools))):
        digest.update(part.encode() + b"\0")
    for name in ("amd", "front_end", "intel", "kernel_code", "nvidia"):
        digest.update(Path(__file__).with_name(f"{name}.py").read_bytes())
    return f"{digest.hexdigest()}.gpu.json"


def _kept(key: str) -> list[KernelCode] | None:
    try:
        return [KernelCode(**each) for each in json.loads(read_file(key) or b"")]
    except (ValueError, TypeError):
        return None
