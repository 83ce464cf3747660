"""Measured ray throughput of devices (bench/rays/device_speed.py), cached with the compiled programs."""

from __future__ import annotations

from dataclasses import asdict
from math import isfinite

from ..device_info import DeviceInfo, Speed
from .kept_results import keep_result, kept_result

#: Suffix of the files.
KIND = "bench.json"


def keep_speed(info: DeviceInfo, speed: Speed) -> bool:
    """Store the speed of a device; return False if that is not possible."""
    return keep_result(info, KIND, asdict(speed))


def kept_speed(info: DeviceInfo) -> Speed | None:
    """Return the stored speed of a device in its present state, or None."""
    try:
        speed = Speed(**{name: float(mrays) for name, mrays in kept_result(info, KIND).items()})
        return speed if all(isfinite(mrays) and mrays > 0 for mrays in asdict(speed).values()) else None
    except (ValueError, TypeError, OverflowError):
        return None
