"""The generated C text at the start of a program: records, the scene's buffers as one struct, types and features."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ..memory_plan import OVERLAP, part_count
from .struct_types import c_typedef

#: C type and array by name; arrays are numpy's or `DeviceArray`s.
Buffers = Mapping[str, tuple[str, Any]]


def scene_struct(buffers: Buffers, part_bytes: int | None = None, others: Sequence[str] = ()) -> str:
    """Return the struct `Scene`, its kernel parameters (SCENE_PARAMETERS) and its initialiser (SCENE_ARGUMENTS).

    The order of `buffers` is the order of the kernel's arguments; the counts come last. part_bytes: maximum size of the
    parts that all buffers are split into (kernels/core/arrays.cl), None for whole buffers. others: further members of
    the struct, 0 unless a kernel sets them.
    """
    typedefs = {c_type: c_typedef(c_type, array.dtype) for c_type, array in buffers.values()}
    members = [f"global const {c_type} *{name}" for name, (c_type, _) in buffers.items()]
    names, parameters, lines = list(buffers), members, [*typedefs.values()]
    if part_bytes is not None:
        counts = {name: part_count(array, part_bytes) for name, (_, array) in buffers.items()}
        members = [f"{member}[{count}]" for member, count in zip(members, counts.values())]
        parameters = [
            f"global const {c_type} *{name}_{i}" for name, (c_type, _) in buffers.items() for i in range(counts[name])
        ]
        names = [f"{{{', '.join(f'{name}_{i}' for i in range(count))}}}" for name, count in counts.items()]
        lines.append(defines({"PART_BYTES": part_bytes, "PART_OVERLAP": OVERLAP}))
    return "\n".join(
        [
            *lines,
            f"typedef struct {{ {' '.join(member + ';' for member in [*members, 'Counts counts', *others])} }} Scene;",
            f"#define SCENE_PARAMETERS {', '.join([*parameters, 'const Counts counts'])}",
            f"#define SCENE_ARGUMENTS {{{', '.join([*names, 'counts'])}}}",
        ]
    )


def type_list(macro: str, types: Iterable[tuple[str, int]]) -> str:
    """Return an X-macro: `#define MACRO(X) X(name, number) …`."""
    return f"#define {macro}(X) {' '.join(f'X({name}, {number})' for name, number in types)}"


def defines(values: Mapping[str, int | float]) -> str:
    """Return `#define NAME number` for each value; a Python float, exact in float32, becomes a float literal."""
    return "\n".join(f"#define {name} {value}{'f' * isinstance(value, float)}" for name, value in values.items())


def typedefs(records: Mapping[str, np.dtype[Any]]) -> str:
    """Return the typedefs of records other than scene buffers."""
    return "\n".join(c_typedef(name, dtype) for name, dtype in records.items())
