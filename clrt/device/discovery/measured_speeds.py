"""Measured speeds of devices (bench/rays/device_speed.py), cached with the compiled programs.

A speed is valid for one device and driver, and for the kernels and version of clrt that were measured.
"""

from __future__ import annotations

import json
from dataclasses import asdict
from math import isfinite

from .. import cache_files
from ..device_info import DeviceInfo, Speed, identity_of
from ..programs.kernel_files import kernel_digest

#: Suffix of the files.
KIND = "bench.json"


def keep_speed(info: DeviceInfo, speed: Speed) -> bool:
    """Store the speed of a device; return False if that is not possible."""
    kept = {"measured": identity_of(info), "kernels": kernel_digest(), "bench": asdict(speed)}
    return cache_files.write_file(f"{info.id}.{KIND}", json.dumps(kept, indent=1).encode())


def kept_speed(info: DeviceInfo) -> Speed | None:
    """Return the stored speed of a device in its present state, or None."""
    content = cache_files.read_file(f"{info.id}.{KIND}")
    try:
        kept = json.loads(content or b"null")
        speed = Speed(**{name: float(mrays) for name, mrays in kept["bench"].items()})
        right = all(isfinite(mrays) and mrays > 0 for mrays in asdict(speed).values())
        current = kept["measured"] == identity_of(info) and kept["kernels"] == kernel_digest()
        return speed if right and current else None
    except (ValueError, TypeError, LookupError, AttributeError, OverflowError, RecursionError):
        return None
