"""Enumerate OpenCL devices, rank them, and select one by name.

The best comes first: GPUs, then other accelerators, CPUs and simulators, larger before smaller; among themselves,
devices with a measured speed are ranked by it. What cannot run clrt is listed last, with the reason. A device that
failed its check (clrt.check) is used only if named.
"""

from __future__ import annotations

import logging
from dataclasses import asdict, replace
from typing import Any

import pyopencl as cl

from ...errors import DeviceError
from ..device_info import DeviceInfo
from ..driver_caches import no_room
from ..launches.fork_safety import check_process
from .check_results import kept_verdict
from .describe_device import describe, describe_empty, describe_faulty, size_of, with_own_id
from .install_advice import no_device
from .loader import devices_of
from .measured_speeds import kept_speed
from .platforms import load_platforms
from .tunings import kept_tuning
from .user_preference import Preference, preferred_device

log = logging.getLogger(__name__)
ORDER = ("gpu", "accelerator", "cpu", "simulator", "none")
#: Fields that not every device has.
OPTIONAL = ("check", "bench", "tuning", "hardware", "known_faults")
Found = list[tuple[DeviceInfo, cl.Device | None]]


def find_devices(again: bool = False, preference: Preference | None = None) -> Found:
    """Return every device of every platform, best first, then platforms and drivers without one.

    `chosen` marks the default device: the one that `preference` names, if it is unique, else the best. That is never a
    simulator, which is a thousand times as slow.

    again: probe faulty drivers again, unless this process has already loaded its drivers.
    """
    found = _by_speed(sorted(_everything(again), key=_capability))
    found = [(replace(info, index=index), device) for index, (info, device) in enumerate(found)]
    infos = [info for info, _ in found]
    usable = [info for info in infos if info.usable]
    chosen = next((info for info in _real(usable) if not info.failed), None)
    if preference:
        named = [info for info, _ in _matching(found, preference.selector)]
        chosen = named[0] if len(named) == 1 and named[0].usable else None
    origin = preference.origin if preference else ""
    return [
        (replace(info, chosen=info is chosen, why=_why(info, infos, chosen, origin)), device) for info, device in found
    ]


def devices() -> list[dict[str, Any]]:
    """Return what `clrt devices --json` prints, a dict per device, best first. UsageError as `preferred_device`."""
    return [as_dict(info) for info, _ in find_devices(again=True, preference=preferred_device())]


def as_dict(info: DeviceInfo) -> dict[str, Any]:
    """Return the fields of a device; those of OPTIONAL only if they are known."""
    return {name: value for name, value in asdict(info).items() if value or name not in OPTIONAL}


def choose(selector: str | int | None = None) -> tuple[DeviceInfo, cl.Device]:
    """Return the device that `selector` names (see `select`); log a warning if its check failed."""
    info, device = select(selector)
    if info.failed:
        log.warning("%s is used although its check failed: %s", info.name, _failures(info))
    log.info("device %d, %s (%s): %s", info.index, info.name, info.platform, info.why)
    return info, device


def select(selector: str | int | None = None) -> tuple[DeviceInfo, cl.Device]:
    """Return the device that `selector` names: a number, an id, "cpu", "gpu" or a unique part of its name or platform.

    Without one, return the user's (see `preferred_device`), else the best. Raises DeviceError, listing the candidates,
    if none or several match, and UsageError for a malformed configuration file.
    """
    found, origin = find_devices(), ""
    if not found:
        raise DeviceError(no_device())
    if selector is None:
        selector, origin = preferred_device() or (None, "")
    asked = f"{selector!r}" + (f" ({origin})" if origin else "")
    matches = _matching(found, selector)
    listing = "\n".join(
        f"  {info.index}  {info.id}  {info.name} ({info.platform}){_trouble(info)}" for info, _ in found
    )
    if not matches and selector is None and any(info.failed for info, _ in found):
        raise DeviceError(
            f"no usable device passed its check; `clrt devices` lists what failed. Update the driver and "
            f"run `clrt devices --check` again, or select a device to use it anyway:\n{listing}"
        )
    if not matches and selector is None and any(info.usable for info, _ in found):
        raise DeviceError(
            "only a simulator, a thousand times as slow, is usable; select it to use it, or "
            f"install a driver (`clrt devices` shows why others are unusable):\n{listing}"
        )
    if not matches and selector is None:
        raise DeviceError(
            f"no device is usable; `clrt devices` shows why and what to do:\n{listing}" + f"\n{no_room()}".rstrip()
        )
    if not matches:
        raise DeviceError(f"no usable device matches {asked}; there are:\n{listing}")
    if len(matches) > 1:
        raise DeviceError(f"{len(matches)} devices match {asked}; select one by number or id:\n{listing}")
    info, device = matches[0]
    if not info.usable or device is None:
        raise DeviceError(f"{info.name} cannot be used: {info.why}")
    return info, device


def _everything(again: bool) -> Found:
    """Return all devices with unique ids, platforms without devices, and drivers that were left out."""
    check_process()
    platforms, faults = load_platforms(again)
    found: Found = []
    for platform in platforms:
        here: Found = [(describe(device), device) for device in devices_of(platform)]
        for info, device in here or [(describe_empty(platform), None)]:
            own = with_own_id(info, {other.id for other, _ in found})
            kept = replace(own, check=kept_verdict(own), bench=kept_speed(own), tuning=kept_tuning(own))
            found.append((kept, device))
    return found + [(describe_faulty(driver, fault), None) for driver, fault in faults.items()]


def _capability(pair: tuple[DeviceInfo, cl.Device | None]) -> tuple[bool, int, int, bool]:
    info, device = pair
    return not info.usable, ORDER.index(info.type), -size_of(device) if device else 0, bool(info.translated)


def _by_speed(found: Found) -> Found:
    """Sort the measured devices by speed among the positions that they occupy; the others keep theirs."""
    speeds = {place: info.bench.mrays for place, (info, _) in enumerate(found) if info.usable and info.bench}
    ranked = dict(zip(speeds, sorted(speeds, key=lambda place: -speeds[place])))
    return [found[ranked.get(place, place)] for place in range(len(found))]


def _why(info: DeviceInfo, infos: list[DeviceInfo], chosen: DeviceInfo | None, origin: str) -> str:
    """Return the remark on a device of `infos`: whether and why it was chosen, and its peculiarities.

    origin: where the chosen device was named, if anywhere.
    """
    if not info.usable:
        return info.why
    speed = f"{info.bench.mrays:.3g} Mrays/s" if info.bench else "not measured"
    notes = [f"{info.type}, {speed}"]
    if info is chosen:
        rivals = sum(other.usable and not other.failed for other in _real(infos))
        rank = "only one" if rivals <= 1 else "fastest measured" if info.bench else f"largest {info.type}"
        notes = [f"chosen because {origin} selects it, {speed}" if origin else f"chosen as the {rank}, {speed}"]
    twin = next((other for other in infos[: info.index] if other.usable and _same_hardware(info, other)), None)
    if twin:
        notes.append(f"same hardware as device {twin.index}, through another platform")
    if info.translated:
        notes.append(f"OpenCL translated to {info.translated}; the hardware's native driver is better")
    if info.failed:
        notes.append(f"but its check failed: {_failures(info)}")
    return "; ".join(notes)


def _real(infos: list[DeviceInfo]) -> list[DeviceInfo]:
    return [info for info in infos if info.type != "simulator"]


def _same_hardware(one: DeviceInfo, other: DeviceInfo) -> bool:
    """Return whether two platforms offer the same hardware.

    CPUs are always the same, as a machine has one kind; others by UUID, PCI address, or at least name.
    """
    if one.type != other.type or one.type == "simulator":
        return False
    if one.type == "cpu":
        return True
    if (one.platform, one.platform_version) == (other.platform, other.platform_version):
        return False
    if one.hardware and other.hardware:
        return bool({*one.hardware} & {*other.hardware})
    return one.name == other.name


def _trouble(info: DeviceInfo) -> str:
    return " failed its check" if info.failed else "" if info.usable else " cannot be used"


def _failures(info: DeviceInfo) -> str:
    """Return the first failure of a device's check, and the number of others."""
    failures = info.check.failures if info.check else []
    return failures[0] + (f" (and {len(failures) - 1} more)" if len(failures) > 1 else "")


def _matching(found: Found, selector: str | int | None) -> Found:
    """Return the candidates for a selector.

    A type selects its best device, preferably one that passed its check; other text selects devices by name, else by
    platform.
    """
    text = str(selector).strip().lower()
    if selector is None or text in ("cpu", "gpu"):
        of_kind = [
            pair for pair in found if pair[0].usable and (pair[0].chosen if selector is None else pair[0].type == text)
        ]
        return sorted(of_kind, key=lambda pair: pair[0].failed)[:1]
    if text.isdigit():
        return [pair for pair in found if text in (str(pair[0].index), pair[0].id)]
    named = [pair for pair in found if text == pair[0].id or text in pair[0].name.lower()]
    return named or [pair for pair in found if text in pair[0].platform.lower()]
