"""Public calls with arguments of any type and in any order either work or raise a ClrtError."""

from __future__ import annotations

import inspect
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
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
BALL = clrt.Scene(spheres=[clrt.Sphere()], render=clrt.RenderSettings(size=(4, 4), spp=1))
TURNED = clrt.turntable(BALL, frames=2)
Mesh: Any = clrt.Mesh  # of lists, which its types do not have
TRIANGLE = clrt.Scene(meshes=[Mesh(np.eye(3), [[0, 1, 2]], uv=[[0, 0], [1, 0], [0, 1]])], render=BALL.render)
POINTS = {"points": [[0, 3, 0]], "normals": [[0, 1, 0]]}
PICTURE = clrt.Image(np.ones((4, 4, 3), np.float32), aovs={"light_group.lamp": np.ones((4, 4, 3), np.float32)})
#: All public functions but `load`, and methods of objects, with the arguments that they need.
FUNCTIONS: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
    "render": (clrt.render, {"scene": BALL}),
    "animate": (clrt.animate, {"scene": TURNED, "frames": [0]}),
    "frames": (clrt.frames, {"scene": TURNED}),
    "turntable": (clrt.turntable, {"scene": BALL, "frames": 2}),
    "stereo_pair": (clrt.stereo_pair, {"camera": BALL.camera, "baseline": 1, "converge_at": 3.0}),
    "each_view": (clrt.each_view, {"scene": BALL, "cameras": [BALL.camera], "layers": "normal"}),
    "render_views": (clrt.render_views, {"scene": BALL, "cameras": [BALL.camera], "layers": "normal"}),
    "save_views": (
        clrt.save_views,
        {"folder": "views", "scene": BALL, "views": [*clrt.each_view(BALL, [BALL.camera])], "formats": "nerf"},
    ),
    "radiance": (clrt.radiance, {"scene": BALL, "origins": [0, 0, 5], "directions": [0, 0, -1]}),
    "irradiance": (clrt.irradiance, {"scene": BALL, **POINTS}),
    "ambient_occlusion": (clrt.ambient_occlusion, {"scene": BALL, **POINTS}),
    "bake": (clrt.bake, {"scene": TRIANGLE, "mesh": "mesh", "size": 4}),
    "relight": (clrt.relight, {"image": PICTURE, "factors": {}}),
    "denoise": (clrt.denoise, {"image": PICTURE}),
    "compare": (clrt.compare, {"image": PICTURE, "reference": PICTURE}),
    "read_image": (clrt.read_image, {"path": "image.png"}),
    "save_scene": (clrt.save_scene, {"scene": BALL, "path": "scene.toml"}),
    "Image.save": (PICTURE.save, {"path": "image.png"}),
    "Camera.from_matrix": (
        clrt.Camera.from_matrix,
        {"K": [[9, 0, 2], [0, 9, 2], [0, 0, 1]], "size": (4, 4), "world_to_camera": np.eye(4)},
    ),
    "Camera.project": (BALL.camera.project, {"points": [[0, 0, 0]], "size": (4, 4)}),
    "Camera.matrix": (BALL.camera.matrix, {"size": (4, 4)}),
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


@pytest.mark.parametrize("name", FUNCTIONS)
def test_any_value_of_an_argument_of_a_function(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Likewise of arguments with a type of their own; those of a list of options are the renderer's."""
    monkeypatch.chdir(tmp_path)
    call, good = FUNCTIONS[name]
    consume(call(**good)) if name != "read_image" else PICTURE.save("image.png")
    for argument, parameter in inspect.signature(inspect.unwrap(call)).parameters.items():
        if argument not in ("self", "cls") and parameter.kind is not inspect.Parameter.VAR_KEYWORD:
            for value in (*WRONG, BALL.camera, clrt.Camera, BALL, [BALL.camera], "lamp=2"):
                if argument != "time" or not _is_time(value):
                    asked(call, good, argument, value)


def _is_time(value: object) -> bool:
    """Return whether a render would take so many seconds."""
    return isinstance(value, int | float | np.float32) and bool(value > 0)


def test_all_functions_are_asked() -> None:
    public = {name for name in clrt.__all__ if inspect.isfunction(getattr(clrt, name))}
    assert public == {name for name in (*FUNCTIONS, "load", "devices") if name[0].islower()}


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


def consume(result: object) -> None:
    if isinstance(result, Iterator):
        for _ in result:
            pass


def asked(call: Callable[..., Any], good: dict[str, Any], argument: str, value: Any) -> None:
    try:
        consume(call(**good | {argument: value}))
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
