"""Cycles as a contestant: Blender as a Python module, `pip install bpy`, on all cores."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ..output.images import read_image
from ..scene.materials import Material
from ..scene.model import Scene
from .contestants import Contestant, Picture
from .cycles_scene import Bsdf, blender_scene, check_scene


def contestants(scene: Scene) -> dict[str, Contestant]:
    """Cycles. ImportError where it is not installed, UsageError for what it cannot draw."""
    library = import_module("bpy")
    check_scene(scene)
    return {"cycles": Cycles(library, scene)}


class Cycles:
    """A contestant; bsdfs: see `blender_scene`.

    Each picture is prepared by Blender, and read from a file: both are in its time.
    """

    def __init__(self, library: Any, content: Scene, bsdfs: Mapping[type[Material], Bsdf] | None = None) -> None:
        self._library, self._content, self._bsdfs = library, content, bsdfs
        self._folder = TemporaryDirectory()
        self._warm = False

    def __call__(self, spp: int, seed: int) -> Picture:
        scene, file = self._scene, Path(self._folder.name) / "picture.exr"
        if not self._warm:
            self._warm = True
            self(1, seed)
        scene.cycles.samples, scene.cycles.seed, scene.render.filepath = spp, seed, str(file)
        start, cpu = time.perf_counter(), time.process_time()
        with _quiet():
            self._library.ops.render.render(scene=scene.name, write_still=True)
        pixels = read_image(file)
        return Picture(spp, time.perf_counter() - start, time.process_time() - cpu, pixels)

    @cached_property
    def _scene(self) -> Any:
        return blender_scene(self._library.data, self._content, Path(self._folder.name), self._bsdfs)


@contextmanager
def _quiet() -> Iterator[None]:
    """Blender tells standard output of every file that it saves."""
    sys.stdout.flush()
    kept = os.dup(1)
    with open(os.devnull, "w") as nothing:
        os.dup2(nothing.fileno(), 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
