"""Results of device checks, cached on disk with the compiled programs (see clrt.check).

A verdict is valid for one device and driver, and for the kernels and version of clrt that were checked. If the file is
malformed, the device counts as not checked.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from .. import cache_files
from ..device_info import DeviceInfo, Verdict, identity_of
from ..programs.kernel_files import kernel_digest

#: Suffix of the files.
KIND = "check.json"


def keep_verdict(info: DeviceInfo, verdict: Verdict) -> bool:
    """Store the verdict on a device; return False if that is not possible."""
    text = json.dumps({"checked": identity_of(info), "verdict": asdict(verdict)}, indent=1)
    return cache_files.write_file(f"{info.id}.{KIND}", text.encode())


def kept_verdict(info: DeviceInfo) -> Verdict | None:
    """Return the stored verdict on a device in its present state, or None."""
    content = cache_files.read_file(f"{info.id}.{KIND}")
    if content is None:
        return None
    try:
        kept = json.loads(content)
        verdict = _verdict(kept["verdict"])
        return verdict if kept["checked"] == identity_of(info) and verdict.kernels == kernel_digest() else None
    except (ValueError, TypeError, LookupError, OverflowError, RecursionError):
        return None


def forget_verdicts() -> int:
    """Delete all stored verdicts; return how many there were."""
    return cache_files.clear(f"*.{KIND}")


def _verdict(stored: Mapping[str, Any]) -> Verdict:
    """Return the verdict from parsed JSON; ValueError, TypeError, LookupError or OverflowError if it is malformed."""
    failures, figures = [str(failure) for failure in stored["failures"]], dict(stored["figures"])
    when, seconds, kernels = str(stored["when"]), float(stored["seconds"]), str(stored["kernels"])
    if stored["passed"] is not (not failures) or not all(isinstance(f, (int, float, str)) for f in figures.values()):
        raise ValueError("it is inconsistent")
    return Verdict(not failures, failures, when, seconds, kernels, figures)
