"""The whole measurement: parts in order within the time given, and results that a later run completes."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

from ...device.device_info import DeviceInfo, identity_of
from ...device.discovery.discover import as_dict, find_devices, select
from ...device.open import POCL
from ...device.programs.kernel_files import kernel_digest
from ...errors import UsageError
from .parts import PARTS
from .request import Request
from .run_part import PartRun

#: Seconds that a part gets at least, if there are as many left.
LEAST = 5.0
DONE, UNFINISHED, FAILED = "done", "unfinished", "failed"


def begin(selector: str | None, *, quick: bool) -> dict[str, Any]:
    """Return results without parts: `identity`, on which they depend, `device`, `other` and `system`."""
    info, _ = select(selector)
    other = other_device(info)
    return {
        "identity": {**identity_of(info), "kernels": kernel_digest(), "quick": quick},
        "device": as_dict(info),
        "other": as_dict(other) if other else None,
        "system": {
            "begun": datetime.now(UTC).isoformat(timespec="seconds"),
            "system": f"{platform.system()} {platform.release()}",
            "machine": platform.machine(),
            "python": platform.python_version(),
        },
        "parts": {},
    }


def resumed(results: dict[str, Any], before: dict[str, Any] | None, path: Path) -> dict[str, Any]:
    """Return earlier results of the same device, driver and kernels, or those that begin without any.

    Raises UsageError if `path` has those of others.
    """
    if before is None:
        return results
    differing = [
        name for name, value in results["identity"].items() if before.get("identity", {}).get(name, value) != value
    ]
    if differing or "identity" not in before:
        raise UsageError(
            f"{path}: has the results of another {' and '.join(differing) or 'program'}; choose another file, or "
            "replace them with --fresh"
        )
    return {**before, "device": results["device"], "other": results["other"]}


def other_device(info: DeviceInfo) -> DeviceInfo | None:
    """Return a device to compare results with: PoCL if it is there, else the best other one; not a simulator."""
    others = [each for each, _ in find_devices() if each.usable and each.type != "simulator" and each.id != info.id]
    return next((each for each in others if each.platform == POCL), others[0] if others else None)


def measure_gpu(
    results: dict[str, Any],
    scenes: Sequence[Path],
    seconds: float,
    *,
    on_item: Callable[[str, str], None] = lambda part, item: None,
    on_part: Callable[[str], None] = lambda part: None,
) -> None:
    """Complete `results`, and call `on_item` with part and item as each begins, `on_part` after each part.

    seconds: for all parts, of which each gets its share of what is left. A part has `state`, `seconds`, `rows` by item
    (see parts.py), and `failure`, if it ended before its last item.
    """
    end = time.monotonic() + seconds
    rest = [name for name in PARTS if results["parts"].get(name, {}).get("state") != DONE]
    while rest:
        left = max(0.0, end - time.monotonic())
        share = PARTS[rest[0]].share / sum(PARTS[name].share for name in rest)
        name = rest.pop(0)
        part = results["parts"].setdefault(name, {"state": UNFINISHED, "seconds": 0.0, "rows": {}})
        _measure_part(name, part, _request(results, scenes, min(left, max(LEAST, left * share))), on_item)
        on_part(name)


def _measure_part(name: str, part: dict[str, Any], request: Request, on_item: Callable[[str, str], None]) -> None:
    run = PartRun(name, request, part["rows"], partial(on_item, name))
    try:
        is_done = run.run()
        part["state"] = FAILED if run.failure else DONE if is_done else UNFINISHED
    finally:
        part["failure"] = run.failure
        part["seconds"] = round(part["seconds"] + run.seconds, 2)


def _request(results: dict[str, Any], scenes: Sequence[Path], seconds: float) -> Request:
    other = results["other"]
    return Request(
        results["device"]["id"],
        other["id"] if other else None,
        results["identity"]["quick"],
        seconds,
        [str(path.resolve()) for path in scenes],
    )
