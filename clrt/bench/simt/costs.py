"""What passes cost: instructions and loads of clrt's kernels, and two numbers fitted to measured rates."""

from __future__ import annotations

from dataclasses import dataclass

from .visits import INSTANCES, LEAVES, NODES, SPHERES, TESTS

#: Instructions of a pass by layout and kind. Nodes and tests: counted in the loops of the ray queries compiled for
#: sm_90 (clang 19, ptxas 13); 48 of a cwbvh node's convert bytes to float, at half the rate. A test has 59 if all lanes
#: are beside the triangle and 178 otherwise. Spheres and instances: estimates.
INSTRUCTIONS = {
    "cwbvh": {NODES: 387 + 48, LEAVES: 0, TESTS: 150, SPHERES: 100, INSTANCES: 150},
    "bvh2": {NODES: 115, LEAVES: 15, TESTS: 150, SPHERES: 100, INSTANCES: 150},
}
#: Load instructions for each 16 bytes of a record, from the same programs: cwbvh loads them at once, others word by
#: word.
LOADS = {
    "cwbvh": {NODES: 1.0, LEAVES: 0.0, TESTS: 3.0, SPHERES: 2.5, INSTANCES: 3.5},
    "bvh2": {NODES: 3.5, LEAVES: 0.0, TESTS: 3.0, SPHERES: 2.5, INSTANCES: 3.5},
}
#: Cycles between the instructions of a lone warp: dependent ones are 4 apart (Jia et al. 2018, arXiv 1804.06826), and
#: every other one is taken to depend on the one before.
LONE_CYCLES = 2
#: Registers of ray queries, and of the extend and connect stages, as compiled for INSTRUCTIONS.
QUERY_REGISTERS = {"cwbvh": 96, "bvh2": 91}
#: Instructions of a megakernel apart from its two traversals: those that all materials share, which is the number for
#: one diffuse material (scenes/cornell.toml); and of the traversals.
SHARED_INSTRUCTIONS, TRAVERSAL_INSTRUCTIONS = 2100, 1100
#: The same of the queues' stage shade.
SHARED_SHADE = 1384
#: Bytes per ray or surface that the stages of queues read and write: the structs of kernels/integrator/wavefront.cl.
STATE_BYTES = {"extend": 44, "shade": 244, "connect": 80}


@dataclass(frozen=True)
class Fitted:
    """Numbers fitted to measured rates (calibrate.py).

    - traversal: measured over modelled time of traversals
    - code: instructions of a megakernel's shading that issue one per cycle; longer code takes longer in proportion
    - shade: cycles per instruction of the queues' stage of that name
    """

    traversal: float
    code: float
    shade: float


#: As fitted to all points of measured.toml.
FITTED = Fitted(traversal=1.67, code=1160.0, shade=1.36)
