"""First use of a GPU: a trial of seconds finds how it renders fastest; see `clrt devices --bench`."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..errors import DeviceError

if TYPE_CHECKING:
    from ..device.open import Device

log = logging.getLogger(__name__)
#: Types of devices that are tuned at their first use. On CPUs the defaults were measured to be fastest.
TUNED = ("gpu", "accelerator")
#: Time limit of a trial in seconds, most of which is compilation.
LIMIT = 120.0


def tuned(devices: Sequence[Device]) -> list[Device]:
    """Return the devices, tuned if they are of a type that is and were not before."""
    return [
        _tuned(device) if device.info.type in TUNED and device.info.tuning is None else device for device in devices
    ]


def _tuned(device: Device) -> Device:
    """Tune a device and store the result; the device as it is if that fails."""
    from dataclasses import replace

    from ..bench.tuning.tune import tune
    from ..device.discovery.tunings import keep_tuning

    log.warning("%s: first use; measuring once how it renders fastest, which takes some seconds", device.info.name)
    try:
        best = tune(device, LIMIT).best
    except DeviceError as error:
        log.warning("%s; it renders by default settings", error)
        return device
    keep_tuning(device.info, best)
    return replace(device, info=replace(device.info, tuning=best))
