"""Record of a path vertex, and the reasons why paths end (kernels/integrator/debug.cl)."""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from ..device.programs.preamble import defines, typedefs
from ..device.programs.struct_types import record

#: position … direction: in the world frame of the compiled scene. throughput: radiance at the camera over radiance
#: arriving here. radiance: emission that arrives here; emission: its contribution. emitter: entry of the light table,
#: or −1. light …: the light sample, unless light is −1; light_bsdf: f·|cos|; light_weight: its MIS weight; sent:
#: whether a shadow ray was traced; unshadowed, direct: its contribution without and with occluders; blocker: a
#: primitive, or −1. direction, weight, pdf, specular: the BSDF sample; weight: f·|cos|/pdf. emission_clamp,
#: direct_clamp: the factors by which clamps scale both contributions, 1 without.
VERTEX = record(
    position="3f4",
    distance="f4",
    geometric_normal="3f4",
    primitive="i4",
    shading_normal="3f4",
    instance="i4",
    throughput="3f4",
    end="i4",
    radiance="3f4",
    front="i4",
    emission="3f4",
    emitter="i4",
    light_direction="3f4",
    light="i4",
    light_radiance="3f4",
    light_probability="f4",
    light_bsdf="3f4",
    light_pdf="f4",
    unshadowed="3f4",
    light_weight="f4",
    direct="3f4",
    blocker="i4",
    direction="3f4",
    blocker_instance="i4",
    weight="3f4",
    pdf="f4",
    specular="i4",
    sent="i4",
    emission_clamp="f4",
    direct_clamp="f4",
)


class PathEnd(IntEnum):
    """Reason why a path ends at a vertex. NONE: it continues. SIDE: the BSDF sample is on the wrong side of the
    geometric normal. LOOPS: the driver ended the kernel's loops (device.loops)."""

    NONE = 0
    ESCAPED = 1
    DEPTH = 2
    ABSORBED = 3
    SIDE = 4
    ROULETTE = 5
    LOOPS = 6


def vertex_preamble() -> str:
    """Return the definitions that kernels/integrator/debug.cl needs: the record, its members by kind, and the numbers
    of End."""
    lists = {"ROWS": np.dtype("3f4"), "REALS": np.dtype("f4"), "INTS": np.dtype("i4")}
    members = {kind: [name for name in VERTEX.names or () if VERTEX[name] == of] for kind, of in lists.items()}
    return "\n".join(
        [
            typedefs({"Vertex": VERTEX}),
            defines({f"END_{end.name}": int(end) for end in PathEnd}),
            *(
                f"#define VERTEX_{kind}(X) {' '.join(f'X({name})' for name in names)}"
                for kind, names in members.items()
            ),
        ]
    )
