"""Fake drivers: shared libraries for the OpenCL loader, with faults compiled in."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from ..c_library import compile_library

SOURCE = Path(__file__).with_name("fake_driver.c")
DEFAULTS = {
    "PLATFORM": '"Fake"',
    "NAME": '"Fake GPU"',
    "UNITS": "100",
    "COUNT": "1",
    "TYPE": "4",
    "REVERSED": "0",
    "UUIDS": "0",
    "REFUSED": "0",
    "ON_LOAD": "",
    "ON_UNLOAD": "",
    "ON_DEVICES": "",
}
FAULTS = {
    "aborts": {"ON_LOAD": "abort()"},
    "hangs": {"ON_LOAD": "sleep(1000)"},
    "empty": {"COUNT": "0"},
    "segfaults": {"ON_DEVICES": "raise(SIGSEGV)"},
    "refuses": {"TYPE": "2", "REFUSED": "0x103A"},
}


def make_driver(vendors: Path, name: str, **choices: str) -> Path:
    """Compile a driver (choices: see fake_driver.c) and register it in the folder `vendors`."""
    vendors.mkdir(exist_ok=True)
    library = vendors / f"lib{name}.so"
    values = DEFAULTS | {"PLATFORM": f'"{name}"'} | choices
    compile_library(SOURCE, library, *(f"-D{key}={value}" for key, value in values.items()))
    (vendors / f"{name}.icd").write_text(f"{library}\n")
    return library


def environment(folder: Path, **more: str) -> dict[str, str]:
    """Return an environment: drivers of folder/vendors and pip, cache in folder/cache, loaded drivers in folder/log."""
    kept = {name: value for name, value in os.environ.items() if name not in ("CLRT_DEVICE", "OCL_ICD_FILENAMES")}
    return (
        kept
        | {
            "OCL_ICD_VENDORS": str(folder / "vendors"),
            "CLRT_CACHE_DIR": str(folder / "cache"),
            "FAKE_LOG": str(folder / "log"),
        }
        | more
    )


def run(folder: Path, *command: str, **more: str) -> subprocess.CompletedProcess[str]:
    """Run Python with these arguments in that environment."""
    return subprocess.run(
        [sys.executable, "-P", *command],
        capture_output=True,
        text=True,
        cwd=folder,
        timeout=60,
        env=environment(folder, **more),
    )


def listed(folder: Path, **more: str) -> list[dict[str, Any]]:
    """Return what `clrt devices --json` prints."""
    result = run(folder, "-m", "clrt", "devices", "--json", **more)
    assert result.returncode == 0, result.stderr
    devices: list[dict[str, Any]] = json.loads(result.stdout)
    return devices


def loads(folder: Path) -> list[str]:
    """Return the drivers loaded since the last call, one entry per process."""
    log = folder / "log"
    names = log.read_text().split() if log.exists() else []
    log.unlink(missing_ok=True)
    return sorted(names)
