"""Preload module of faulty workers: CLRT_TEST_FAULT selects the fault."""

from __future__ import annotations

import os
from typing import Any

from clrt.errors import DeviceError
from clrt.farm import worker_tasks
from clrt.rendering.accumulation.device_worker import DeviceWorker, WorkerShare

if not hasattr(worker_tasks, "right"):  # Dask loads this more than once
    setattr(worker_tasks, "right", (worker_tasks.identity, worker_tasks.render_share, DeviceWorker.ended))
_identity, _share, _ended = getattr(worker_tasks, "right")
_first: list[DeviceWorker] = []


def another_version() -> dict[str, str]:
    """Report the identity of a worker with an older clrt."""
    return {**_identity(), "version": "0.0.1"}


def share_of_nans(*arguments: Any) -> Any:
    """Return NaN pixels, as a device with broken memory might."""
    answer = _share(*arguments)
    answer.value[0]["sum"][0, 0, 0] = float("nan")
    return answer


def share_that_crashes(*arguments: Any) -> Any:
    """Kill the process at tile 0, as a driver that crashes on some tile."""
    if 0 in arguments[1]:
        os.kill(os.getpid(), 9)
    return _share(*arguments)


def ended_of_a_lost_device(self: DeviceWorker) -> WorkerShare | None:
    """Lose the process's first device after it has rendered more than 4096 samples."""
    _first[:] = _first or [self]
    if self is _first[0] and self.samples > 4096:
        raise DeviceError("the device is lost")
    share: WorkerShare | None = _ended(self)
    return share


match os.environ.get("CLRT_TEST_FAULT"):
    case "version":
        setattr(worker_tasks, "identity", another_version)
    case "nan":
        setattr(worker_tasks, "render_share", share_of_nans)
    case "crash":
        setattr(worker_tasks, "render_share", share_that_crashes)
    case "lost":
        setattr(DeviceWorker, "ended", ended_of_a_lost_device)
