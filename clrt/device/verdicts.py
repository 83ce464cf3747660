"""What checks of devices found, kept on disk beside the compiled programs (see clrt.check).

A verdict counts for one device with one driver, and for the kernels and the version of clrt that were checked. Whatever
the file holds that is no such verdict, the device has not been checked.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

from . import cache
from .sources import kernel_digest

if TYPE_CHECKING:
    from .describe import DeviceInfo

#: How the names of their files end.
KIND = "check.json"


@dataclass(frozen=True)
class Verdict:
    """failures: what was wrong, a sentence each, none where it passed. figures: what was measured, by name.

    when: the time of the check in UTC (ISO 8601); seconds: how long it took. kernels: the digest (sources.py) of those
    that were checked.
    """

    passed: bool
    failures: list[str] = field(hash=False)     # lists and dicts have no hash; equal verdicts have equal ones without
    when: str
    seconds: float
    kernels: str
    figures: dict[str, float | str] = field(default_factory=dict, hash=False)


def keep_verdict(info: DeviceInfo, verdict: Verdict) -> bool:
    """Stores the verdict on a device; False where that is not possible."""
    text = json.dumps({"checked": identity_of(info), "verdict": asdict(verdict)}, indent=1)
    return cache.write_file(f"{info.id}.{KIND}", text.encode())


def kept_verdict(info: DeviceInfo) -> Verdict | None:
    """The verdict on a device as it is now, or None."""
    content = cache.read_file(f"{info.id}.{KIND}")
    if content is None:
        return None
    try:
        kept = json.loads(content)
        verdict = _verdict(kept["verdict"])
        return verdict if kept["checked"] == identity_of(info) and verdict.kernels == kernel_digest() else None
    except (ValueError, TypeError, LookupError, OverflowError, RecursionError):
        return None


def forget_verdicts() -> int:
    """Deletes all that are kept; returns how many there were."""
    return cache.clear(f"*.{KIND}")


def identity_of(info: DeviceInfo) -> dict[str, str]:
    """All that what is found about a device depends on, but for the kernels."""
    try:
        own = version("clrt")
    except PackageNotFoundError:
        own = "not installed"
    return {"device": info.id, "name": info.name, "platform_version": info.platform_version, "driver": info.driver,
            "clrt": own}


def _verdict(stored: Mapping[str, Any]) -> Verdict:
    """A verdict of what JSON brought; raises ValueError, TypeError, LookupError or OverflowError where that is none."""
    failures, figures = [str(failure) for failure in stored["failures"]], dict(stored["figures"])
    when, seconds, kernels = str(stored["when"]), float(stored["seconds"]), str(stored["kernels"])
    if stored["passed"] is not (not failures) or not all(isinstance(f, (int, float, str)) for f in figures.values()):
        raise ValueError("it contradicts itself")
    return Verdict(not failures, failures, when, seconds, kernels, figures)
