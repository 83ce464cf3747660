"""Loaded by workers that are to be broken: CLRT_TEST_FAULT says how."""

from __future__ import annotations

import os
from typing import Any

from clrt.errors import DeviceError
from clrt.farm import worker_tasks
from clrt.rendering.accumulation.device_worker import Share, Worker

if not hasattr(worker_tasks, "right"):    # Dask loads this more than once
    setattr(worker_tasks, "right", (worker_tasks.identity, worker_tasks.render_share, Worker.ended))
_identity, _share, _ended = getattr(worker_tasks, "right")
_first: list[Worker] = []


def another_version() -> dict[str, str]:
    """What a worker with an older clrt would say."""
    return {**_identity(), "version": "0.0.1"}


def share_of_nans(*arguments: Any) -> Any:
    """What a device with broken memory might give."""
    answer = _share(*arguments)
    answer.value[0]["sum"][0, 0, 0] = float("nan")
    return answer


def share_that_crashes(*arguments: Any) -> Any:
    """What a driver that cannot bear some tile does."""
    if 0 in arguments[1]:
        os.kill(os.getpid(), 9)
    return _share(*arguments)


def ended_of_a_lost_device(self: Worker) -> Share | None:
    """The process's first device is gone once it has rendered something for the picture."""
    _first[:] = _first or [self]
    if self is _first[0] and self.samples > 4096:
        raise DeviceError("the device is lost")
    share: Share | None = _ended(self)
    return share


match os.environ.get("CLRT_TEST_FAULT"):
    case "version":
        setattr(worker_tasks, "identity", another_version)
    case "nan":
        setattr(worker_tasks, "render_share", share_of_nans)
    case "crash":
        setattr(worker_tasks, "render_share", share_that_crashes)
    case "lost":
        setattr(Worker, "ended", ended_of_a_lost_device)
