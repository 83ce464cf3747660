"""Constructs that OpenCL C allows but that the kernels must avoid."""

from __future__ import annotations

import re
from collections.abc import Iterator
from math import prod
from pathlib import Path

from clrt.accel.morton import DIGIT_BITS
from clrt.device.launches.data_parallel import SCAN_ITEMS, TILE_ITEMS
from clrt.scene.materials.material_types import MATERIALS

KERNELS = Path(__file__).parents[1] / "kernels"
TEXTS = {str(path.relative_to(KERNELS)): path.read_text(encoding="utf-8") for path in KERNELS.rglob("*.cl")}
STRUCTS = {name for text in TEXTS.values() for name in re.findall(r"^typedef struct.*?} (\w+);", text, re.M | re.S)}
HEAD = r"^(?:__attribute__.*? )?(?:static|kernel) [^;{}]*?\b(\w+)\(([^;{}]*)\)\s*"
FUNCTION = re.compile(HEAD + r"\{([^\n]*\}$|.*?^\})", re.M | re.S)


def changed_parameters(text: str, structs: set[str]) -> Iterator[tuple[str, str]]:
    """Yield functions with the struct parameters that they receive by value and modify."""
    for function, parameters, body in FUNCTION.findall(re.sub(r"//.*", "", text)):
        for name in re.findall(rf"\b(?:{'|'.join(sorted(structs))}) (\w+)\s*(?:,|$)", parameters):
            if re.search(rf"(?<![\w.>]){name}\b[.\w\[\]]*\s*(?:[-+*/&|^]|<<|>>)?=(?!=)", body):
                yield function, name


def test_structs_that_come_by_value_are_not_changed() -> None:
    """Mesa's rusticl (22.3) would modify the caller's struct."""
    assert not [(file, *changed) for file, text in TEXTS.items() for changed in changed_parameters(text, STRUCTS)]


def test_changed_structs_are_found() -> None:
    text = """
static float first(Pair p, Pair q, const Pair *r) {
    float x = p.x == q.x;
    q.x += x;
    return q.x;
}
__attribute__((always_inline)) static inline float second(Pair p,
                                                          int i) {
    p = other[i];
    return p.x;
}
"""
    assert list(changed_parameters(text, {"Pair"})) == [("first", "q"), ("second", "p")]
    assert {"real3", "Hit", "Flight", "Box"} <= STRUCTS


DIRECT = re.compile(r"scene->(?!counts\b)(\w+)\s*(?:\[|->|\+)")


def test_arrays_of_the_scene_may_be_in_parts() -> None:
    """Scene arrays may be split, so records must be accessed by RECORD or GATHER only (core/arrays.cl)."""
    assert not [(file, array) for file, text in TEXTS.items() for array in DIRECT.findall(re.sub(r"//.*", "", text))]


def test_direct_access_is_found() -> None:
    text = "scene->nodes[3].x + scene->counts.lights + scene->sky->width + RECORD(scene->packs, i)->p0 + (scene->a + 1)"
    assert DIRECT.findall(text) == ["nodes", "sky", "a"]


#: Least local memory of OpenCL 1.2's full profile, and all that Apple's GPUs have.
MOST_LOCAL = 32 << 10
LOCAL = re.compile(r"\blocal (?:const )?([a-z]+)(\d*) \w+\[([\w *]+)\]")
BYTES = {"uchar": 1, "char": 1, "ushort": 2, "short": 2, "uint": 4, "int": 4, "float": 4, "ulong": 8, "long": 8}


def local_bytes(text: str, values: dict[str, int]) -> int:
    """Return the local memory of all arrays of a file; values: of names that a program defines."""
    return sum(
        BYTES[kind] * (4 if width == "3" else int(width or 1)) * prod(_value(each, values) for each in count.split("*"))
        for kind, width, count in LOCAL.findall(re.sub(r"//.*", "", text))
    )


def _value(factor: str, values: dict[str, int]) -> int:
    return int(factor) if factor.strip().isdigit() else values[factor.strip()]


def test_kernels_need_no_more_local_memory_than_every_device_has() -> None:
    """The limit is that of a kernel; no file exceeds it with those of all its kernels."""
    values = {
        "SCAN_ITEMS": SCAN_ITEMS,
        "TILE_ITEMS": TILE_ITEMS,
        "DIGITS": 1 << DIGIT_BITS,
        "KINDS": 1 + len(MATERIALS),
    }
    sizes = {file: local_bytes(text, values) for file, text in TEXTS.items()}
    assert {file for file, size in sizes.items() if size > MOST_LOCAL} == set()
    assert {"build/scan.cl", "build/ploc.cl"} <= {file for file, size in sizes.items() if size}
    declared = {file for file, text in TEXTS.items() if re.search(r"^\s+(?:__)?local(?: \w+)+ \w+\b", text, re.M)}
    assert declared == {file for file, size in sizes.items() if size}, "of a form that is not counted"


def test_local_memory_is_counted() -> None:
    text = "    local uint2 a[N];\n    local float b[3]; // local float c[9];\n    local float3 d[2 * N];"
    assert local_bytes(text, {"N": 5}) == 5 * 8 + 3 * 4 + 2 * 5 * 16


#: Constructs that drivers are known to fail at: an image argument that a kernel does not use (OpenCLOn12), enqueueing
#: by a device (ROCm), builds of hours for loops that must be unrolled (NVIDIA); and what OpenCL C 1.2 leaves optional.
FRAGILE = {
    "images": r"\bimage\d+d\w*_t\b|\bread_image|\bwrite_image|\bsampler_t\b",
    "kernels enqueued by kernels": r"\benqueue_kernel\b|\bndrange_t\b|\bqueue_t\b",
    "loops that must be unrolled": r"#pragma unroll|\bopencl_unroll_hint\b|\bunroll\s*\(",
    "double precision": r"\bdouble\d*\b|\bcl_khr_fp64\b",
    "half precision": r"\bhalf\d*\b(?=[\s*]+\w)|\bcl_khr_fp16\b",
    "printf": r"\bprintf\s*\(",
    "variables of a program": r"^(?:static )?global\b[^(;]*;",
    "inline assembly": r"\basm\b",
}
#: Files that unroll loops, whose bodies are short: polynomials, texels, words of a state, cache lines to prefetch.
UNROLLING = {"bsdf/ggx_albedo.cl", "core/bilinear.cl", "core/lanes.cl", "core/mask.cl", "integrator/compaction.cl"}
UNROLL = re.compile(r'_Pragma\("unroll"\)|\bUNROLLED\b')


def fragile(text: str) -> list[str]:
    """Return the names of the constructs of FRAGILE in a kernel file."""
    code = re.sub(r"//.*", "", text)
    return [name for name, pattern in FRAGILE.items() if re.search(pattern, code, re.MULTILINE)]


def test_what_breaks_drivers_is_absent() -> None:
    """Local memory, another limit, is counted above."""
    assert not [(file, found) for file, text in TEXTS.items() if (found := fragile(text))]
    assert {file for file, text in TEXTS.items() if UNROLL.search(text)} == UNROLLING


def test_fragile_constructs_are_found() -> None:
    text = """
#pragma unroll 8
global int counter;
kernel void k(read_only image2d_t image, global half *a, global float *b) {
    asm("nop");
    printf("%f", b[0] + (double)b[1]);
    enqueue_kernel(get_default_queue(), 0, ndrange_1D(1), ^{});   // half of it, printf()
}
"""
    assert fragile(text) == list(FRAGILE)
    assert not fragile(
        "// half a double-word, printf()\nstatic inline void f(global int *a) {}\nkernel void k(global int *a) {}"
    )
