"""Devices of a worker. Schedulers import this module, too, so heavy imports are local to functions."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..device.open import Device


@cache
def opened(selectors: tuple[str | int, ...]) -> list[Device]:
    """Return this worker's selected devices, opened once."""
    from ..device.open import open_devices

    return open_devices(selectors or None)


def about(devices: list[Device]) -> dict[str, Any]:
    """Return the devices' distinct names, platforms and drivers."""
    return {
        name: " + ".join(dict.fromkeys(getattr(device.info, name) for device in devices))
        for name in ("name", "platform", "platform_version", "driver")
    }
