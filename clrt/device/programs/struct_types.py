"""Records shared by host and device. A numpy dtype defines each, and the C typedef is generated from it.

Fields are float32, int32, uint32 or uint8, scalars or arrays, in an order that needs no padding, and a record's size is
a multiple of 16: then numpy and every OpenCL compiler agree on its layout.
"""

from __future__ import annotations

from typing import Any

import numpy as np

C_TYPES = {np.dtype("f4"): "float", np.dtype("i4"): "int", np.dtype("u4"): "uint", np.dtype("u1"): "uchar"}


def c_typedef(name: str, dtype: np.dtype[Any]) -> str:
    """Return the C typedef of a structured dtype, e.g. `typedef struct { float center[3]; float radius; } Sphere;`."""
    members = []
    for field in dtype.names or ():
        base, shape = dtype[field].subdtype or (dtype[field], ())
        members.append(f"{C_TYPES[base]} {field}{''.join(f'[{n}]' for n in shape)};")
    return f"typedef struct {{ {' '.join(members)} }} {name};"


def record(**fields: str) -> np.dtype[Any]:
    """Return a record dtype from `name="3f4"` specifications. Raises ValueError if its size is not a multiple of 16."""
    dtype = np.dtype([(name, spec) for name, spec in fields.items()])
    if dtype.itemsize % 16:
        raise ValueError(f"record of {dtype.itemsize} bytes: add padding to a multiple of 16")
    return dtype
