"""Compile times of scenes in new processes, with empty caches and from them, and what the compiler reports.

`python -m clrt.bench.gpu.compiles JSON` is such a process.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from subprocess import DEVNULL, TimeoutExpired
from tempfile import TemporaryDirectory, TemporaryFile
from typing import Any

from ...device.device_info import Paths
from ...device.open import open_device
from ...device.programs.child_process import end_child, last_line, start_child, told_end
from ...device.programs.kernel_resources import kernel_resources
from ...errors import DeviceError
from ...formats.load_scene import load
from ...rendering.compile.choices import Choices
from ...rendering.renderer import Renderer
from .executions import executions
from .request import Item, Request, Row
from .small_scenes import smaller

#: Scenes from small programs to large ones.
SCENES = ("cornell", "dragon", "materials", "textures")
#: Environment variables of program caches: clrt's, PoCL's, and those of the drivers of NVIDIA, Intel, AMD and Mesa.
CACHES = (
    "CLRT_CACHE_DIR",
    "POCL_CACHE_DIR",
    "CUDA_CACHE_PATH",
    "NEO_CACHE_DIR",
    "AMD_COMGR_CACHE_DIR",
    "MESA_SHADER_CACHE_DIR",
)


def items(request: Request) -> Iterator[Item]:
    """Yield some of the scenes with each of `Paths`."""
    files = {file.stem: file for file in map(Path, request.scenes)}
    chosen = [files[name] for name in SCENES if name in files] or list(files.values())
    for paths in executions(request.device):
        for file in chosen[: 1 if request.quick else None]:
            yield Item(f"{file.stem}, {paths}", partial(_compile, file, paths, request))


def _compile(file: Path, paths: Paths, request: Request) -> Row:
    """Return the seconds, and `rows` with the resources of each kernel of the program."""
    Choices(paths=paths).on(open_device(request.device))
    with TemporaryDirectory() as cache:
        cold, warm = (
            compile_in_process(file, request.device, request.seconds, cache, resources=resources, paths=paths)
            for resources in (False, True)
        )
    return {
        "characters": cold["characters"],
        "cold_seconds": cold["program_seconds"],
        "warm_seconds": warm["program_seconds"],
        "cold_ready_seconds": cold["ready_seconds"],
        "warm_ready_seconds": warm["ready_seconds"],
        "rows": warm["resources"],
    }


def compile_in_process(
    file: Path,
    device: str,
    limit: float,
    cache: str | None = None,
    *,
    resources: bool = False,
    paths: Paths | None = None,
) -> dict[str, Any]:
    """Return what `compile_here` returns in a new process with this folder of all caches, None for the user's.

    Raises DeviceError if that fails or takes more than `limit` seconds.
    """
    argument = json.dumps({"file": str(file), "device": device, "resources": resources, "paths": paths})
    caches = {} if cache is None else dict.fromkeys(CACHES, cache)
    with TemporaryFile() as output, TemporaryFile() as errors:
        child = start_child(__name__, argument, output, errors, DEVNULL, False, **caches)
        try:
            code = child.wait(limit)
        except TimeoutExpired as error:
            raise DeviceError(f"{file.stem} was not compiled in {limit:g} s") from error
        finally:
            end_child(child)
        if code:
            raise DeviceError(f"{file.stem} was not compiled: {told_end(code)}{last_line(errors)}")
        output.seek(0)
        figures: dict[str, Any] = json.loads(output.read())
        return figures


def compile_here(file: str, device: str, *, resources: bool, paths: Paths | None) -> dict[str, Any]:
    """Compile a scene file in this process; resources: whether to ask the compiler for registers and memory."""
    scene = smaller(load(file))
    start = time.perf_counter()
    renderer = Renderer(scene, device=device, paths=paths)
    ready, source = time.perf_counter() - start, renderer.compiled.source
    return {
        "ready_seconds": ready,
        "program_seconds": renderer.session.build_seconds,
        "characters": len(source),
        "resources": kernel_resources(renderer.device, source) if resources else {},
    }


def main() -> None:
    """Print the figures as JSON; what drivers print goes to standard error."""
    with os.fdopen(os.dup(1), "w", encoding="utf-8") as result:
        os.dup2(2, 1)
        json.dump(compile_here(**json.loads(sys.argv[1])), result)


if __name__ == "__main__":
    main()
