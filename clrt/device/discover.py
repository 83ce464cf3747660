"""Which OpenCL devices there are, which can be used, and which one is meant.

The best comes first: GPUs, then other accelerators, CPUs and simulators, the larger before the smaller. A device
that cannot run clrt is listed with the reason, last. One that failed its check (clrt.check) is used only if named.
"""

from __future__ import annotations

import hashlib
import logging
import os
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from typing import Any

import pyopencl as cl

from ..errors import DeviceError
from .fork import check_process
from .verdicts import Verdict, kept_verdict

MINIMUM_ALLOCATION = 16 << 20


@dataclass(frozen=True)
class DeviceInfo:
    """One OpenCL device. `id` stays the same until the platform or driver changes; `why` says what `usable` means.

    check: what its last check found; None where it was not checked as it is now.
    """

    index: int
    id: str
    name: str
    platform: str
    platform_version: str
    driver: str
    type: str
    compute_units: int
    global_bytes: int
    max_alloc_bytes: int
    usable: bool
    why: str
    chosen: bool
    check: Verdict | None = None

    @property
    def failed(self) -> bool:
        """Whether its check failed."""
        return self.check is not None and not self.check.passed


def find_devices() -> list[tuple[DeviceInfo, cl.Device]]:
    """Every device of every platform, best first. `chosen` marks the one that is used when none is named.

    That is no simulator, unless there is nothing else: they are a thousand times as slow.
    """
    found = sorted(_every_device(), key=_rank)
    infos: list[DeviceInfo] = []
    for device in found:
        infos.append(_describe(device, infos))
    usable = [info for info in infos if info.usable]
    real = [info for info in usable if info.type != "simulator"]
    chosen = next((info for info in real or usable if not info.failed), None)
    return [(replace(info, chosen=info is chosen), device) for info, device in zip(infos, found)]


def devices() -> list[dict[str, Any]]:
    """What `clrt devices --json` prints: a dict for each device, best first."""
    return [as_dict(info) for info, _ in find_devices()]


def as_dict(info: DeviceInfo) -> dict[str, Any]:
    """The fields of a device, and of its check if it was checked."""
    return {name: value for name, value in asdict(info).items() if name != "check" or value}


def choose(selector: str | int | None = None) -> tuple[DeviceInfo, cl.Device]:
    """The device that `selector` names (see `select`); a warning is logged where its check failed."""
    info, device = select(selector)
    if info.failed:
        logging.getLogger(__name__).warning("%s is used though its check failed: %s", info.name, _failures(info))
    return info, device


def select(selector: str | int | None = None) -> tuple[DeviceInfo, cl.Device]:
    """The device that `selector` names: a number, an id, "cpu", "gpu" or a unique part of a name.

    Without one, $CLRT_DEVICE, else the best. Raises DeviceError, listing the candidates, where none or several match.
    """
    found = find_devices()
    if not found:
        raise DeviceError('no OpenCL device: install one with `pip install "pyopencl[pocl]"` or a GPU driver')
    if selector is None:
        selector = os.environ.get("CLRT_DEVICE") or None
    matches = [pair for pair in found if _matches(pair[0], selector)]
    if str(selector).lower() in ("cpu", "gpu", "none"):
        matches = sorted((pair for pair in matches if pair[0].usable), key=lambda pair: pair[0].failed)[:1]
    listing = "\n".join(f"  {info.index}  {info.id}  {info.name} ({info.platform}){' failed its check' * info.failed}"
                        for info, _ in found)
    if not matches and selector is None and any(info.failed for info, _ in found):
        raise DeviceError(f"no usable device passed its check; `clrt devices` says what failed. Update the driver and "
                          f"run `clrt devices --check` again, or name a device to use it all the same:\n{listing}")
    if not matches:
        raise DeviceError(f"no usable device matches {selector!r}; there are:\n{listing}")
    if len(matches) > 1:
        raise DeviceError(f"{len(matches)} devices match {selector!r}; name one by number or id:\n{listing}")
    if not matches[0][0].usable:
        raise DeviceError(f"{matches[0][0].name} cannot be used: {matches[0][0].why}")
    return matches[0]


def _every_device() -> Iterator[cl.Device]:
    check_process()
    try:
        platforms = cl.get_platforms()
    except cl.Error:
        return
    for platform in platforms:
        try:
            yield from platform.get_devices()
        except cl.Error:
            continue  # a platform without devices must not hide the others


def _rank(device: cl.Device) -> tuple[bool, int, int]:
    order = {"gpu": 0, "accelerator": 1, "cpu": 2, "simulator": 3}
    return bool(_unusable(device)), order[_type(device)], -device.max_compute_units * device.max_clock_frequency


def _type(device: cl.Device) -> str:
    if "Oclgrind" in device.platform.name:
        return "simulator"
    if device.type & cl.device_type.GPU:
        return "gpu"
    return "cpu" if device.type & cl.device_type.CPU else "accelerator"


def _unusable(device: cl.Device) -> str:
    """Why the device cannot run clrt; empty where it can."""
    if not device.available:
        return "the driver says that it is not available"
    if not device.compiler_available:
        return "its driver has no compiler"
    if not device.endian_little:
        return "it is big-endian"
    if device.max_mem_alloc_size < MINIMUM_ALLOCATION:
        return f"its largest buffer is {device.max_mem_alloc_size} bytes; {MINIMUM_ALLOCATION} are needed"
    return ""


def _describe(device: cl.Device, before: list[DeviceInfo]) -> DeviceInfo:
    """The device after those of `before`. Of several that are alike the second and later get ids of their own."""
    platform = device.platform
    identity = "|".join([platform.name, platform.version, device.vendor, device.name, device.driver_version])
    ids = (hashlib.sha256(f"{identity}{twin}".encode()).hexdigest()[:8] for twin in ["", *range(1, len(before) + 1)])
    reason = _unusable(device)
    info = DeviceInfo(
        index=len(before), id=next(i for i in ids if i not in [other.id for other in before]), name=device.name.strip(),
        platform=platform.name.strip(), platform_version=platform.version.strip(), driver=device.driver_version.strip(),
        type=_type(device), compute_units=device.max_compute_units, global_bytes=device.global_mem_size,
        max_alloc_bytes=device.max_mem_alloc_size, usable=not reason,
        why=reason or f"a {_type(device)} with OpenCL C 1.2", chosen=False)
    info = replace(info, check=kept_verdict(info))
    return replace(info, why=f"{info.why}, but its check failed: {_failures(info)}") if info.failed else info


def _failures(info: DeviceInfo) -> str:
    """What the first failure of its check was, and how many there were."""
    failures = info.check.failures if info.check else []
    return failures[0] + (f" (and {len(failures) - 1} more)" if len(failures) > 1 else "")


def _matches(info: DeviceInfo, selector: str | int | None) -> bool:
    if selector is None:
        return info.chosen
    text = str(selector).strip().lower()
    if text in ("cpu", "gpu"):
        return info.type == text
    return text in (str(info.index), info.id) or (not text.isdigit() and text in info.name.lower())
