"""Public calls with arguments of any type and in any order either work or raise a ClrtError."""

from __future__ import annotations

import inspect
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clrt
from clrt.device.open import Device
from clrt.errors import ClrtError

from .misuse import outcome
from .oracle.scenes import todays_seed

pytestmark = pytest.mark.processes

WRONG: tuple[Any, ...] = (
    None,
    "x",
    "",
    -1,
    0,
    1.5,
    10**20,
    np.nan,
    np.inf,
    [],
    [[1, 2]],
    (1,),
    np.zeros((2, 4)),
    {"a": 1},
    object(),
    np.array(["a"]),
    True,
    b"x",
    1j,
    np.float32(3),
)
SCENES = Path(__file__).parents[1] / "scenes"
SCENE = clrt.load(SCENES / "cornell.toml")
CALLS: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
    "Renderer": (clrt.Renderer, {"scene": SCENE, "size": (4, 4), "spp": 1}),
    "RayQuery": (clrt.RayQuery, {"vertices": np.eye(3), "faces": [[0, 1, 2]]}),
    "InstancedRayQuery": (
        clrt.InstancedRayQuery,
        {"meshes": [(np.eye(3), [[0, 1, 2]])], "mesh": [0], "transforms": np.eye(3, 4)[None]},
    ),
    "load": (clrt.load, {"path": SCENES / "models" / "spot.obj"}),
}
#: Arguments that are files or callbacks, not values to choose from.
OTHER = {"on_phase", "before", "checkpoint", "resume"}


@pytest.mark.parametrize("name", CALLS)
def test_any_value_of_an_argument(device: Device, name: str) -> None:
    """Any value of an argument is accepted or raises a ClrtError."""
    call, good = CALLS[name]
    good = good | ({} if name == "load" else {"device": device.info.index})
    for argument in inspect.signature(call).parameters.keys() - OTHER:
        for value in WRONG:
            asked(call, good, argument, value)


def test_any_value_of_a_method(device: Device) -> None:
    rays = {"origins": [0, 0, 1], "directions": [0, 0, -1]}
    query = clrt.RayQuery(np.eye(3), [[0, 1, 2]], device=device.info.index)
    renderer = clrt.Renderer(SCENE, size=(4, 4), spp=1, device=device.info.index)
    for value in WRONG:
        for method in (query.closest_hit, query.any_hit, query.all_hits):
            for argument in inspect.signature(method).parameters:
                asked(method, rays, argument, value)
        asked(query.refit, {}, "vertices", value)
        asked(renderer.look, {}, "camera", value)
        for argument in ("time", "error", "reference"):
            asked(lambda **given: list(renderer.passes(**given)), {"spp": 1}, argument, value)


def test_a_sequence_of_calls() -> None:
    """One random sequence of calls; `python -m tests.misuse` runs many."""
    fault = outcome(todays_seed())
    assert not fault, fault


def asked(call: Callable[..., Any], good: dict[str, Any], argument: str, value: Any) -> None:
    try:
        call(**good | {argument: value})
    except ClrtError:
        pass
    except Exception as error:
        raise AssertionError(f"{call} with {argument} = {value!r}") from error


INTERRUPTED = """
import signal, sys, threading, clrt
def compiles(frame):
    return frame is not None and (frame.f_code.co_name == "quietly_built" or compiles(frame.f_back))
def interrupt():
    while not any(map(compiles, list(sys._current_frames().values()))):
        pass
    signal.raise_signal(signal.SIGINT)
threading.Thread(target=interrupt, daemon=True).start()
clrt.RayQuery([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], builder="ploc").closest_hit([0, 0, 1], [0, 0, -1])
"""


def test_a_compiler_that_is_interrupted(tmp_path: Path) -> None:
    """KeyboardInterrupt propagates from a build, and ending the compiler thread at exit does no harm."""
    caches = os.environ | {"CLRT_CACHE_DIR": str(tmp_path), "POCL_CACHE_DIR": str(tmp_path / "pocl")}
    done = subprocess.run([sys.executable, "-c", INTERRUPTED], env=caches, capture_output=True, text=True, timeout=120)
    assert done.stderr.splitlines()[-1] == "KeyboardInterrupt", done.stderr
    assert done.returncode == -signal.SIGINT
