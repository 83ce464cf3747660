"""From kernel files to a built program: composition, build, cache.

A program's text is a preamble (records, choices, features) followed by whole kernel files. Names in quotation marks
after #include are resolved here, each file once, and `#include NAME` stands for the files that the scene selects for
NAME, possibly none. So the text has exactly what the scene needs. `--print-kernel` shows what is compiled, except for
the suffix of kernel names (bitcode.py). The known problems of -I (spaces in paths, driver caches that ignore included
files) cannot occur.
"""

from __future__ import annotations

import hashlib
import logging
import os
import re
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources.abc import Traversable

import pyopencl as cl

from ...errors import KernelError
from ...threads import Event
from ..cache_files import can_keep, keep_log, read_binary, write_binary
from ..driver_caches import no_room
from ..open import Device
from ..pocl.cpu_name import best_processor, processor_flags
from ..pocl.kernel_cache import remove_damaged
from .background_compile import LIMIT, in_background
from .bitcode import find_bitcode, name_kernels, takes_bitcode
from .compile_process import LARGE, compile_aside, quietly_built
from .kernel_files import kernel_folder

log = logging.getLogger(__name__)
OPTIONS = ["-cl-std=CL1.2"]
#: Oclgrind's LLVM lacks an intrinsic that its clang emits when it optimises or inlines an always_inline function.
SIMULATOR_OPTIONS = ["-cl-opt-disable", "-Dalways_inline="]
_INCLUDE = re.compile(r'^#include\s+(?:"([^"]+)"|(\w+))\s*$')
#: Maximum number of programs kept in memory per context, least recently used first out: each takes some megabytes.
MOST_KEPT = 32


@dataclass(frozen=True)
class BuiltProgram:
    """A program ready to run.

    `cached`: it was not compiled from source; `build_seconds`: time to build or load it; `ending`: suffix of its
    kernels' names (see bitcode.py).
    """

    program: cl.Program
    build_seconds: float
    cached: bool
    ending: str


def compose(preamble: str, entry: str, choices: Mapping[str, Sequence[str]], folder: Traversable | None = None) -> str:
    """Return the text of a program: `preamble`, then the file `entry` with all that it includes.

    choices: the files for each NAME in `#include NAME`. folder: the kernel files' folder (default clrt.kernels).
    """
    folder = folder or kernel_folder()
    seen: set[str] = set()
    lines = [preamble]

    def include(name: str) -> None:
        if name in seen:
            return
        seen.add(name)
        lines.append(f'#line 1 "{name}"')
        for number, line in enumerate(folder.joinpath(name).read_text(encoding="utf-8").splitlines(), start=1):
            match = _INCLUDE.match(line)
            if not match:
                lines.append(line)
                continue
            for chosen in [match[1]] if match[1] else choices[match[2]]:
                include(chosen)
            lines.append(f'#line {number + 1} "{name}"')

    include(entry)
    return "\n".join(lines) + "\n"


def files_of(source: str) -> list[str]:
    """Return the names of the kernel files in a composed text."""
    return re.findall(r'^#line 1 "(.+)"$', source, re.MULTILINE)


def build(device: Device, source: str, data_bytes: int = 0) -> BuiltProgram:
    """Build `source` for the device, or take it from memory or the cache. Raises KernelError with the log on failure.

    PoCL caches compiled kernels itself; clrt's cache then holds bitcode, or an empty entry to record that a program was
    built. If the device has no fma instruction, kernels/core/fma.cl is prepended. data_bytes: approximate size of the
    program's data; for large data PoCL's front end runs in the compile process (compile_process.py).
    """
    start = time.perf_counter()
    source = program_text(device, source)
    key, programs = program_key(device, source), device.shared.programs
    ending = _ending(device, key)
    program = programs.pop(key, None)
    cached = program is not None
    if program is None:
        if ahead := device.shared.ahead.pop(key, None):
            in_background(_where(device), ahead.wait)
        binary = read_binary(key)
        program = _from_binary(device, binary)
        cached = program is not None or binary == b""
        program = program or _built(device, key, source, ending, device.is_pocl and data_bytes >= LARGE)
        if not program.get_info(cl.program_info.NUM_KERNELS) and remove_damaged():
            program = _built(device, key, source, ending)
        device.shared.compiled += not cached
    programs[key] = program
    for old in list(programs)[:-MOST_KEPT]:
        programs.pop(old, None)
    seconds = time.perf_counter() - start
    log.info("program of %d files %s in %.2f s", len(files_of(source)), "found" if cached else "built", seconds)
    log.debug("its files: %s", " ".join(files_of(source)))
    return BuiltProgram(program, seconds, cached, ending)


def is_kept(device: Device, source: str) -> bool:
    """Return whether `build` would find the program in memory or the cache."""
    key = program_key(device, program_text(device, source))
    return key in device.shared.programs or read_binary(key) is not None


def compile_ahead(device: Device, source: str) -> None:
    """Compile in the compile process what `build` will soon need (PoCL only), and wait for it."""
    if is_kept(device, source) or not can_keep() or os.environ.get("POCL_KERNEL_CACHE") == "0":
        return
    whole = program_text(device, source)
    key, done = program_key(device, whole), Event()
    device.shared.ahead[key] = done
    try:
        compile_aside(device.info.id, name_kernels(whole, _ending(device, key)), OPTIONS, LIMIT)
    finally:
        done.set()


def make_kernel(device: Device, built: BuiltProgram, name: str) -> cl.Kernel:
    """Return the kernel `name` of a program. Raises KernelError if the driver fails only now."""
    from sqlite3 import Error  # pyopencl imports it at the first kernel

    try:
        try:
            return cl.Kernel(built.program, name + built.ending)
        except Error:  # pyopencl's cache of kernel invokers is damaged, or its disk is full
            cl._PYOPENCL_NO_CACHE = True
            return cl.Kernel(built.program, name + built.ending)
    except cl.Error as error:
        raise KernelError(f"{_where(device)} cannot create kernel {name}: {error}") from error


def program_text(device: Device, source: str) -> str:
    """Return the source, preceded by functions that the device lacks."""
    return source if device.fuses else compose("", "core/fma.cl", {}) + source


def build_options(device: Device) -> list[str]:
    """Return the compiler options for the device."""
    return OPTIONS + (SIMULATOR_OPTIONS if device.info.type == "simulator" else [])


def program_key(device: Device, source: str) -> str:
    """Return the cache key of a program.

    It includes the processor: machines may share a cache, and processors of the same name may differ in features.
    """
    identity = [
        source,
        *OPTIONS,
        device.info.id,
        device.info.platform_version,
        device.info.driver,
        best_processor(processor_flags()),
    ]
    return hashlib.sha256("\n".join(identity).encode()).hexdigest()


def _ending(device: Device, key: str) -> str:
    """Return the suffix of kernel names, empty unless programs are built from bitcode."""
    return f"_{key[:32]}" if takes_bitcode(device.info.platform_version) else ""


def _built(device: Device, key: str, source: str, ending: str, aside: bool = False) -> cl.Program:
    """Compile the program from source, and cache what it can be built from next time."""
    source = name_kernels(source, ending)
    if aside:
        in_background(_where(device), lambda: compile_aside(device.info.id, source, OPTIONS, LIMIT))
    program, other = _compile(device, source), None
    if device.is_pocl:
        binary = find_bitcode(ending) or b"" if ending else b""
        other = _from_binary(device, binary)  # use it now, too, so that its kernels are compiled only once
        write_binary(key, binary if other else b"")
    else:
        binaries: list[bytes] = program.get_info(cl.program_info.BINARIES)  # type: ignore[assignment]
        write_binary(key, binaries[0])
    return other or program


def _from_binary(device: Device, binary: bytes | None) -> cl.Program | None:
    try:
        return quietly_built(cl.Program(device.context, [device.cl], [binary]), []) if binary else None
    except (cl.Error, ValueError):
        return None  # the driver may reject an old or damaged binary: compile again


def _compile(device: Device, source: str) -> cl.Program:
    start, log = time.perf_counter(), "interrupted"
    program = cl.Program(device.context, source)
    try:
        in_background(_where(device), lambda: quietly_built(program, build_options(device)))
        log = f"built in {time.perf_counter() - start:.2f} s\n{_build_log(device, program)}"
    except cl.Error as error:
        log = "\n".join(filter(None, [str(error).strip(), no_room()]))
        raise KernelError(f"{_where(device)} cannot build the kernel:\n{log}") from error
    except KernelError as error:
        log = str(error)
        raise
    finally:
        keep_log("build", f"{_where(device)}, driver {device.info.driver}\n{', '.join(files_of(source))}\n{log}")
    return program


def _where(device: Device) -> str:
    """Return the device's name for messages."""
    return f"{device.info.name} ({device.info.platform})"


def _build_log(device: Device, program: cl.Program) -> str:
    """Return the compiler's log."""
    try:
        log = program.get_build_info(device.cl, cl.program_build_info.LOG)  # type: ignore[no-untyped-call]
        return str(log).strip()
    except (cl.Error, UnicodeDecodeError):
        return ""
