"""Have PoCL 3.0, the version that pip installs, generate code for a processor that its own library was compiled for.

Its library comes in variants: one for AVX2, compiled for Intel's Haswell, one for AVX-512, and so on. LLVM 14 inlines
library functions only into code for the same processor, or one with a superset of its features. Otherwise, as for AMD's
Zen 1 to 3 and Intel's Alder Lake, fma, fabs and vload8 remain calls, and renders take twice the time and more. Zen 4 is
misdetected as Zen 3, which has no AVX-512, and LLVM aborts at the first fma of the library. Later processors are called
"generic", a name that its own front end rejects: every program fails with "unknown target CPU 'generic'".

The name is a pointer in PoCL's device structure, next to the target triple; `name_processor` points it at the best
processor of such a library that this machine supports. It changes nothing unless exactly one such pair is found.
"""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Set
from functools import cache
from pathlib import Path

import pyopencl as cl

#: LLVM name → the /proc/cpuinfo flags of the instructions that its code generator may use, best first.
PROCESSORS = {
    "icelake-server": {
        "avx512f",
        "avx512dq",
        "avx512bw",
        "avx512vl",
        "avx512cd",
        "avx512vbmi",
        "avx512_vbmi2",
        "avx512_vnni",
        "avx512_bitalg",
        "avx512_vpopcntdq",
        "avx512ifma",
        "gfni",
        "fma",
        "bmi2",
        "movbe",
    },
    "skylake-avx512": {"avx512f", "avx512dq", "avx512bw", "avx512vl", "avx512cd", "fma", "bmi2", "movbe"},
    "haswell": {"avx2", "fma", "bmi1", "bmi2", "f16c", "movbe"},
    "nehalem": {"sse4_2", "popcnt"},
}
SEARCHED_BYTES = 1024
_names: list[ctypes.Array[ctypes.c_char]] = []  # PoCL keeps the pointers, so the strings must stay alive


@cache
def processor_flags() -> frozenset[str]:
    """Return the CPU's feature flags as Linux names them; empty on other systems."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return frozenset()
    return next((frozenset(line.split(":")[1].split()) for line in lines if line.startswith("flags")), frozenset())


def best_processor(flags: Set[str]) -> str:
    """Return the first of PROCESSORS whose requirements `flags` satisfy, else the plain "x86-64"."""
    return next((name for name, needs in PROCESSORS.items() if needs <= flags), "x86-64")


def is_misnamed(name: str, flags: Set[str]) -> bool:
    """Return whether LLVM 14 should use another name for a processor with these features.

    Processors without AVX2 have library variants of their own.
    """
    return name == "generic" or ("avx2" in flags and name != best_processor(flags))


def name_processor(device: cl.Device) -> bool:
    """Set the PoCL device's processor to that of its library; return True if it was another."""
    if "LLVM 14" not in device.platform.version or not Path("/proc/self/mem").exists():
        return False
    flags = processor_flags()
    found = [
        offset
        for offset, text, neighbour in _strings(device.int_ptr)
        if is_misnamed(text, flags) and neighbour.startswith("x86_64")
    ]
    if len(found) != 1:
        return False
    _names.append(ctypes.create_string_buffer(best_processor(flags).encode()))
    ctypes.c_uint64.from_address(device.int_ptr + found[0]).value = ctypes.addressof(_names[-1])
    return True


def _strings(address: int) -> list[tuple[int, str, str]]:
    """Return (offset, string, neighbouring pointer's string) of every pointer to text in the structure at `address`.

    Reads through /proc/self/mem, where a word that is not a pointer gives an error instead of a crash.
    """
    with open("/proc/self/mem", "rb", buffering=0) as memory:
        memory.seek(address)
        words = struct.unpack(f"<{SEARCHED_BYTES // 8}Q", memory.read(SEARCHED_BYTES))

        def text(pointer: int) -> str:
            if not 4096 <= pointer < 1 << 47:
                return ""
            try:
                memory.seek(pointer)
                return memory.read(32).split(b"\0")[0].decode("ascii")
            except (OSError, UnicodeDecodeError):
                return ""

        texts = [text(word) for word in words]
    return [
        (8 * i, texts[i], texts[i - 1] if texts[i - 1].startswith("x86_64") else texts[i + 1])
        for i in range(1, len(texts) - 1)
        if texts[i]
    ]
