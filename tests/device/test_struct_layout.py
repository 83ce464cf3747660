"""Host and device use the same layout of every record, by sizes and offsets read on the device."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pyopencl as cl
import pytest

from clrt.accel import cwbvh, layouts, triangle_forms
from clrt.bench.numerics.bsdf_cases import variants
from clrt.device.open import Device
from clrt.device.programs.program import build, make_kernel
from clrt.device.programs.struct_types import c_typedef, record
from clrt.rendering.compile import records
from clrt.scene.materials.material_types import MATERIALS

RECORDS: dict[str, np.dtype[Any]] = {
    f"{module.__name__.rsplit('.', 1)[1]}_{name}": value
    for module in (records, layouts, cwbvh, triangle_forms)
    for name, value in vars(module).items()
    if isinstance(value, np.dtype) and value.names
}
OF_MATERIALS = {f"material_{kind.__name__}": kind for kind in MATERIALS}


@cache
def all_records() -> dict[str, np.dtype[Any]]:
    """Return RECORDS and those of materials: of one with each set of features, as tables of energies take time."""
    found = dict(RECORDS)
    for name, kind in OF_MATERIALS.items():
        one_of_each = {frozenset(material.features()): material for material in variants(kind)}
        found[name] = records.parameter_record(material.parameters() for material in one_of_each.values())
    return found


def offsets(dtype: np.dtype[Any]) -> list[int]:
    return [place[1] for place in (dtype.fields or {}).values()]


def test_every_record_is_here() -> None:
    """The records of rendering and the BVHs are in RECORDS."""
    assert len(RECORDS) >= 13 + 6


def test_device_agrees_with_numpy(device: Device) -> None:
    """A program with all typedefs writes the size of each record and the offset of each member."""
    places, texts = [], []
    for name, dtype in all_records().items():
        texts.append(c_typedef(name, dtype))
        places.append(f"sizeof({name})")
        places += [
            f"(uint)((global char *)&(({name} global *)base)->{field} - (global char *)base)"
            for field in dtype.names or ()
        ]
    writes = "".join(f"out[{i}] = {place};" for i, place in enumerate(places))
    source = "\n".join([*texts, f"kernel void sizes(global uint *base, global uint *out) {{ {writes} }}"])
    kernel = make_kernel(device, build(device, source), "sizes")
    found = np.zeros(len(places), np.uint32)
    scratch, out = (cl.Buffer(device.context, cl.mem_flags.READ_WRITE, size) for size in (4096, found.nbytes))
    kernel.set_args(scratch, out)
    cl.enqueue_nd_range_kernel(device.queue, kernel, (1,), (1,))
    cl.enqueue_copy(device.queue, found, out)
    expected = [size for dtype in all_records().values() for size in (dtype.itemsize, *offsets(dtype))]
    wrong = [(place, int(a), b) for place, a, b in zip(places, found, expected) if a != b]
    assert not wrong


@pytest.mark.combinations
def test_pyopencl_agrees(device: Device) -> None:
    """pyopencl's own matching of dtypes to C structs gives the same layout."""
    for name, dtype in all_records().items():
        matched, _ = cl.tools.match_dtype_to_c_struct(device.cl, name, dtype)
        assert matched.itemsize == dtype.itemsize
        assert offsets(matched) == offsets(dtype)


@pytest.mark.parametrize("name", [*RECORDS, *OF_MATERIALS])
def test_records_keep_the_rules(name: str) -> None:
    """Members are aligned as in C without gaps; sizes are multiples of 16, except in tables read field by field."""
    dtype = all_records()[name]
    members = [dtype[field] for field in dtype.names or ()]
    assert sum(member.itemsize for member in members) == dtype.itemsize
    assert all(place % member.base.itemsize == 0 for member, place in zip(members, offsets(dtype)))
    numbers = dict.fromkeys(("EMITTER_GROUP", "FILTER", "LIGHT_PLACE", "LIGHT_PLACEMENT", "LINEAR", "MOTION_NUMBER"), 4)
    numbers["OPAQUE"] = 1
    alone = {**numbers, "QUARTER": 8, "SKY_STEP": 8, "TEXEL": 4}
    assert dtype.itemsize % alone.get(name.removeprefix("records_"), 16) == 0


def test_typedef() -> None:
    dtype = record(center="3f4", radius="f4", box="(2,3)f4", index="i4", flags="u4", meta="16u1")
    assert c_typedef("Thing", dtype) == (
        "typedef struct { float center[3]; float radius; float box[2][3]; int index; "
        "uint flags; uchar meta[16]; } Thing;"
    )


def test_a_record_needs_a_multiple_of_16_bytes() -> None:
    with pytest.raises(ValueError, match="20 bytes"):
        record(center="3f4", radius="f4", index="i4")
