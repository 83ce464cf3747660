"""Gives the OpenCL libraries a folder for their caches where the user's own cannot be written.

PoCL hides its device, and pyopencl fails, when their cache folders cannot be made: no HOME, a read-only one. They read
these variables as they load, so this module is imported before pyopencl.
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path


def provide_cache_folders() -> None:
    """Points XDG_CACHE_HOME and POCL_CACHE_DIR to a temporary folder unless the user's cache folder can be written."""
    home = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    try:
        Path(home).mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=home):
            return
    except (OSError, RuntimeError):
        folder = os.path.join(tempfile.gettempdir(), f"clrt-cache-{os.getuid() if hasattr(os, 'getuid') else 0}")
        os.makedirs(folder, exist_ok=True)
        os.environ["XDG_CACHE_HOME"] = folder
        os.environ.setdefault("POCL_CACHE_DIR", os.path.join(folder, "pocl"))


provide_cache_folders()
