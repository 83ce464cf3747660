"""Measured results on devices, cached with the compiled programs.

A result is valid for one device and driver, and for the kernels and version of clrt that were measured.
"""

from __future__ import annotations

import json
from typing import Any

from .. import cache_files
from ..device_info import DeviceInfo, identity_of
from ..programs.kernel_files import kernel_digest


def keep_result(info: DeviceInfo, kind: str, result: dict[str, Any]) -> bool:
    """Store a result as `kind`, the end of the file's name; return False if that is not possible."""
    kept = {"measured": identity_of(info), "kernels": kernel_digest(), "result": result}
    return cache_files.write_file(f"{info.id}.{kind}", json.dumps(kept, indent=1).encode())


def kept_result(info: DeviceInfo, kind: str) -> dict[str, Any]:
    """Return the stored result of a device in its present state; empty if there is none or the file is malformed."""
    content = cache_files.read_file(f"{info.id}.{kind}")
    try:
        kept = json.loads(content or b"null")
        current = kept["measured"] == identity_of(info) and kept["kernels"] == kernel_digest()
        return dict(kept["result"]) if current else {}
    except (ValueError, TypeError, LookupError, RecursionError):
        return {}
