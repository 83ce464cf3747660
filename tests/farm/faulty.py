"""Loaded by workers that are to be broken: CLRT_TEST_FAULT says how."""

from __future__ import annotations

import os
from typing import Any

from clrt.farm import remote

if not hasattr(remote, "right"):    # Dask loads this more than once
    setattr(remote, "right", (remote.identity, remote.render_share))
_identity, _share = getattr(remote, "right")


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


match os.environ.get("CLRT_TEST_FAULT"):
    case "version":
        setattr(remote, "identity", another_version)
    case "nan":
        setattr(remote, "render_share", share_of_nans)
    case "crash":
        setattr(remote, "render_share", share_that_crashes)
