"""Cycles as a contestant: Blender as a Python module, `pip install bpy`, on all cores."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cached_property, partial
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ...output.images import read_image
from ...scene.model import Scene
from ..convergence.contestants import Contestant, Picture
from .cycles_scene import blender_scene, check_scene


def contestants(scene: Scene, file: Path | None = None) -> dict[str, Contestant]:
    """Return Cycles, whose scene is converted whatever the file.

    Raises ImportError if it is not installed, UsageError if it does not support the scene.
    """
    library = import_module("bpy")
    check_scene(scene)
    return {"cycles": Cycles(library, partial(blender_scene, library.data, scene))}


class Cycles:
    """Contestant. make: returns Blender's scene, whose images may be written to a folder (see `blender_scene`).

    The time of an image includes Blender's preparation and reading the image from a file.
    """

    def __init__(self, library: Any, make: Callable[[Path], Any]) -> None:
        self._library, self._make = library, make
        self._folder = TemporaryDirectory()
        self._warm = False

    def __call__(self, spp: int, seed: int) -> Picture:
        scene, file = self._scene, Path(self._folder.name) / "picture.exr"
        if not self._warm:
            self._warm = True
            self(1, seed)
        scene.cycles.samples, scene.cycles.seed, scene.render.filepath = spp, seed, str(file)
        start, cpu = time.perf_counter(), time.process_time()
        with quiet():
            self._library.ops.render.render(scene=scene.name, write_still=True)
        pixels = read_image(file)
        return Picture(spp, time.perf_counter() - start, time.process_time() - cpu, pixels)

    @cached_property
    def _scene(self) -> Any:
        return self._make(Path(self._folder.name))


@contextmanager
def quiet() -> Iterator[None]:
    """Discard standard output, where Blender and its add-ons report every saved file."""
    sys.stdout.flush()
    kept = os.dup(1)
    with open(os.devnull, "w") as nothing:
        os.dup2(nothing.fileno(), 1)
    try:
        yield
    finally:
        sys.stdout.flush()
        os.dup2(kept, 1)
        os.close(kept)
