"""GPUs that the model knows: what their makers and published measurements say of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

#: Registers are given to lanes in steps of this many (CUDA C++ Programming Guide, technical specifications).
REGISTER_STEP = 8


@dataclass(frozen=True)
class Gpu:
    """A GPU of `cores` multiprocessors (compute units, Xe-cores) at `ghz`, each of `schedulers` that issue one
    instruction of a warp in `cycles` cycles.

    - width: lanes of a warp; warps: most of a scheduler; registers: 32-bit registers of a scheduler for all its lanes
      (0: warps do not depend on them)
    - l1_bytes: of a core; l1_cycles, l2_cycles: latency of loads
    - l2_bytes, memory_gbs: of the whole chip; memory_cycles: latency
    """

    name: str
    cores: int
    ghz: float
    schedulers: int
    cycles: int
    width: int
    warps: int
    registers: int
    l1_bytes: int
    l1_cycles: int
    l2_cycles: int
    l2_bytes: int
    memory_gbs: float
    memory_cycles: int

    def in_flight(self, registers: int) -> int:
        """Return the warps of a scheduler that are resident with so many registers per lane, at least one."""
        if not self.registers:
            return self.warps
        a_lane = -(-registers // REGISTER_STEP) * REGISTER_STEP
        return max(1, min(self.warps, self.registers // (self.width * a_lane)))


_H200 = Gpu(
    "NVIDIA H200",
    cores=132,
    ghz=1.98,
    schedulers=4,
    cycles=1,
    width=32,
    warps=16,
    registers=16384,
    l1_bytes=256 << 10,
    l1_cycles=41,
    l2_cycles=270,
    l2_bytes=50 << 20,
    memory_gbs=4800,
    memory_cycles=600,
)
#: Counts, sizes, bandwidths and the highest clock are those that the makers state. Latencies of loads: RDNA 2's second
#: cache takes 66 ns longer than its first, memory 226 ns (Chips and Cheese 2021); Turing's caches take 32 and 236
#: cycles (github.com/sjfeng1999/gpu-arch-microbenchmark), those of larger chips are estimated to take longer; all of
#: Arc's are estimates. Rates depend little on them (docs/measurements/gpu-model.md).
GPUS = {
    "H200": _H200,
    "H100": replace(_H200, name="NVIDIA H100 SXM", memory_gbs=3350),
    "RTX 4070 Ti": Gpu(
        "NVIDIA RTX 4070 Ti",
        cores=60,
        ghz=2.61,
        schedulers=4,
        cycles=1,
        width=32,
        warps=12,
        registers=16384,
        l1_bytes=128 << 10,
        l1_cycles=43,
        l2_cycles=273,
        l2_bytes=48 << 20,
        memory_gbs=504,
        memory_cycles=540,
    ),
    "RX 6700 XT": Gpu(
        "AMD RX 6700 XT",
        cores=40,
        ghz=2.58,
        schedulers=2,
        cycles=1,
        width=32,
        warps=16,
        registers=32768,
        l1_bytes=16 << 10,
        l1_cycles=110,
        l2_cycles=280,
        l2_bytes=96 << 20,
        memory_gbs=384,
        memory_cycles=580,
    ),
    "Arc A770": Gpu(
        "Intel Arc A770",
        cores=32,
        ghz=2.4,
        schedulers=16,
        cycles=2,
        width=16,
        warps=8,
        registers=0,
        l1_bytes=192 << 10,
        l1_cycles=140,
        l2_cycles=400,
        l2_bytes=16 << 20,
        memory_gbs=560,
        memory_cycles=900,
    ),
}
