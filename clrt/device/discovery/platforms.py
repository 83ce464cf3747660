"""The platforms of all drivers that can be loaded, and the faults of the others.

A driver is probed (driver_probe.py) before this process loads it. The result is cached on disk for the driver's current
files: success until one of them or the machine changes, a fault for an hour.
"""

from __future__ import annotations

import hashlib
import json
import logging
import os
import platform
import sys
import time
from typing import Any

import pyopencl as cl

from .. import cache_files
from .drivers import Driver, installed_drivers
from .loader import load, load_all
from .windows_drivers import is_loaded, not_loaded, pip_drivers

log = logging.getLogger(__name__)
#: Suffix of the files that cache probe results.
KIND = "driver.json"
#: Seconds for which a cached fault is valid.
FAULTY = 3600.0

Faults = dict[Driver, str]
_loaded: tuple[list[cl.Platform], Faults] | None = None


def load_platforms(again: bool = False) -> tuple[list[cl.Platform], Faults]:
    """Return the platforms, and the fault of each driver that was left out. again: probe faulty drivers again.

    A process loads its drivers once, so later calls return the same.
    """
    global _loaded
    if _loaded is None:
        if sys.platform == "linux":
            faults = faults_of(installed_drivers(), again)
            good = [driver.library for driver, fault in faults.items() if not fault]
            log.debug("loading the OpenCL drivers %s", ", ".join(good) or "none")
            _loaded = load(good), {driver: fault for driver, fault in faults.items() if fault}
        else:
            added = pip_drivers()
            platforms = load_all([driver.library for driver in added])
            _loaded = platforms, {driver: not_loaded(driver) for driver in added if not is_loaded(driver)}
    return _loaded


def faults_of(drivers: list[Driver], again: bool = False) -> Faults:
    """Return the fault of each driver, empty if there is none; probe those without a cached result."""
    faults = {driver: _kept(driver, again) for driver in drivers}
    unknown = [driver for driver, fault in faults.items() if fault is None]
    if unknown:
        from .driver_probe import probe

        for driver, fault in zip(unknown, probe([driver.library for driver in unknown])):
            faults[driver] = fault
            content = {"state": _state(driver), "fault": fault, "when": time.time()}
            cache_files.write_file(_name(driver), json.dumps(content).encode())
            if fault and not again:
                log.warning("the OpenCL driver %s is ignored: %s; see `clrt devices`", driver.library, fault)
    return {driver: fault or "" for driver, fault in faults.items()}


def _kept(driver: Driver, again: bool) -> str | None:
    """Return the cached result of a probe, or None if there is none or it has expired."""
    content = cache_files.read_file(_name(driver))
    try:
        kept = json.loads(content or b"null")
        fault = str(kept["fault"])
        fresh = not again and 0 <= time.time() - float(kept["when"]) < FAULTY
        return fault if kept["state"] == _state(driver) and (fresh or not fault) else None
    except (ValueError, TypeError, LookupError, OverflowError, RecursionError):
        return None


def _name(driver: Driver) -> str:
    return f"{hashlib.sha256(f'{driver.library}|{driver.source}'.encode()).hexdigest()[:16]}.{KIND}"


def _state(driver: Driver) -> list[Any]:
    """Return what a probe's result depends on: the driver's files, the machine and its kernel (part of some driver)."""
    files = []
    for path in (driver.library, driver.source):
        try:
            status = os.stat(path)
            files.append([os.path.realpath(path), status.st_mtime_ns, status.st_size])
        except OSError:
            files.append([path])
    return [*files, platform.node(), platform.release(), platform.version()]
