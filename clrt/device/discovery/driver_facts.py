"""Properties that a device's driver reports and that matter for speed, by OpenCL's names."""

from __future__ import annotations

from typing import Any

import pyopencl as cl

NAMES = (
    "vendor",
    "version",
    "opencl_c_version",
    "driver_version",
    "max_compute_units",
    "max_clock_frequency",
    "max_work_group_size",
    "local_mem_size",
    "global_mem_size",
    "global_mem_cache_size",
    "global_mem_cacheline_size",
    "max_mem_alloc_size",
    "max_constant_buffer_size",
    "max_parameter_size",
    "native_vector_width_float",
    "host_unified_memory",
    "single_fp_config",
    "profiling_timer_resolution",
    "warp_size_nv",
    "registers_per_block_nv",
    "compute_capability_major_nv",
    "compute_capability_minor_nv",
    "wavefront_width_amd",
    "simd_per_compute_unit_amd",
    "extensions",
)


def driver_facts(device: cl.Device) -> dict[str, Any]:
    """Return what the driver reports of NAMES."""
    facts = {}
    for name in NAMES:
        try:
            facts[name] = getattr(device, name)
        except (cl.Error, AttributeError):  # not known to this driver or pyopencl
            continue
    return facts
