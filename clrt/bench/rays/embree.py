"""Embree 4 through its C interface: the library in the package embreex, and a C loop over all rays and threads.

The loop, embree_loop.c, is compiled on demand. Enumeration values are those of Embree 4's headers.
"""

from __future__ import annotations

import ctypes
import os
import subprocess
import tempfile
import time
from ctypes import Structure, byref, c_longlong, c_size_t, c_uint, c_void_p
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import UsageError
from .ray_speed import Floats, Rays
from .workloads import Faces

SOURCE = Path(__file__).with_name("embree_loop.c")
COMPILER = ["cc", "-O3", "-march=native", "-shared", "-fPIC", "-pthread"]
TRIANGLES = 0
ROBUST = 1 << 2
COHERENT = 1 << 16
VERTICES, FLOAT3 = 1, 0x9003
INDICES, UINT3 = 0, 0x5003


class _Work(Structure):
    """`Work` of embree_loop.c."""

    _fields_ = [
        ("one", c_void_p),
        ("eight", c_void_p),
        ("scene", c_void_p),
        ("arguments", c_void_p),
        ("origins", c_void_p),
        ("directions", c_void_p),
        ("t_max", c_void_p),
        ("t", c_void_p),
        ("primitive", c_void_p),
        ("count", c_size_t),
        ("next", c_size_t),
        ("life", c_longlong),
        ("inside", c_longlong),
        ("processor", c_longlong),
    ]


class _Arguments(Structure):
    """RTCIntersectArguments and RTCOccludedArguments, with room for members that builds of Embree add."""

    _fields_ = [("flags", c_uint), ("feature_mask", c_uint), ("others", c_void_p * 8)]


class EmbreeScene:
    """Triangles in an Embree BVH: vertices (n, 3) float32, faces (m, 3) int32; robust: its watertight mode.

    build_seconds: of the BVH, with Embree's default quality; bytes: Embree's memory for the scene. Raises UsageError if
    embreex or a C compiler is missing, or if Embree fails.
    """

    def __init__(self, vertices: Floats, faces: Faces, *, robust: bool = False) -> None:
        self._embree, loop = _library(), _loop()
        self.threads = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        held = c_longlong(0)
        self._device = self._new("rtcNewDevice", f"threads={self.threads}".encode())
        self._embree.rtcSetDeviceMemoryMonitorFunction(self._device, loop.count_bytes, byref(held))
        self.handle = self._new("rtcNewScene", self._device)
        self._embree.rtcSetSceneFlags(self.handle, ROBUST if robust else 0)
        geometry = self._new("rtcNewGeometry", self._device, TRIANGLES)
        self._fill(geometry, VERTICES, FLOAT3, np.ascontiguousarray(vertices, np.float32))
        self._fill(geometry, INDICES, UINT3, np.ascontiguousarray(faces, np.uint32))
        self._embree.rtcCommitGeometry(geometry)
        self._embree.rtcAttachGeometry(self.handle, geometry)
        self._embree.rtcReleaseGeometry(geometry)
        start = time.perf_counter()
        self._embree.rtcCommitScene(self.handle)
        self.build_seconds = time.perf_counter() - start
        self._embree.rtcSetDeviceMemoryMonitorFunction(self._device, None, None)
        self._check("rtcCommitScene")
        self.bytes = held.value

    def close(self) -> None:
        """Release the memory."""
        self._embree.rtcReleaseScene(self.handle)
        self._embree.rtcReleaseDevice(self._device)

    def function(self, name: str) -> c_void_p:
        """Return a pointer to an Embree function."""
        return ctypes.cast(getattr(self._embree, name), c_void_p)

    def _fill(self, geometry: c_void_p, kind: int, form: int, array: NDArray[Any]) -> None:
        target = self._new("rtcSetNewGeometryBuffer", geometry, kind, 0, form, c_size_t(12), c_size_t(len(array)))
        ctypes.memmove(target, array.ctypes.data, array.nbytes)

    def _new(self, name: str, *arguments: Any) -> c_void_p:
        """Call an Embree function and return its pointer."""
        function = getattr(self._embree, name)
        function.restype = c_void_p
        if not (pointer := function(*arguments)):
            self._check(name)
        return c_void_p(pointer)

    def _check(self, name: str) -> None:
        if error := self._embree.rtcGetDeviceError(getattr(self, "_device", None)):
            raise UsageError(f"Embree's {name} fails with error {error}")


class EmbreeRays:
    """Rays (as for `RayQuery`, float32) to trace through a scene, singly or in packets of 8 (`width`).

    Results are stored in t (n,) float32 and primitive (n,) int32. Closest hits: a miss has t_max and −1; any hit
    (`any_hit`): t = −inf for a hit.
    """

    def __init__(
        self, scene: EmbreeScene, rays: Rays, *, any_hit: bool, width: int = 1, coherent: bool = False
    ) -> None:
        self._scene = scene
        self._inputs = [np.ascontiguousarray(array, np.float32) for array in rays]
        self.t, self.primitive = np.zeros(len(rays[2]), np.float32), np.zeros(len(rays[2]), np.int32)
        self._arguments = _Arguments(COHERENT if coherent else 0, 0xFFFFFFFF)
        function = scene.function(f"rtc{'Occluded' if any_hit else 'Intersect'}{width}")
        arrays = [array.ctypes.data for array in [*self._inputs, self.t, self.primitive]]
        self._work = _Work(
            function if width == 1 else None,
            function if width == 8 else None,
            scene.handle,
            ctypes.addressof(self._arguments),
            *arrays,
            len(self.t),
        )

    def trace(self) -> tuple[float, float]:
        """Trace all rays on all threads. Return seconds and processor seconds, both without the overhead of the loop.

        The seconds are scaled by the fraction that threads spend inside Embree's functions.
        """
        start = time.perf_counter()
        if error := _loop().trace_all(byref(self._work), self._scene.threads):
            raise OSError(error, os.strerror(error))
        seconds = time.perf_counter() - start
        return seconds * self._work.inside / self._work.life, self._work.processor / 1e9


@cache
def _library() -> ctypes.CDLL:
    """Load Embree from embreex."""
    try:
        folder = Path(import_module("embreex").__path__[0])
    except ImportError:
        raise UsageError("not installed (pip install embreex)") from None
    found = [file for place in (folder.with_name("embreex.libs"), folder) for file in place.rglob("libembree4*")]
    if not found:
        raise UsageError(f"no Embree 4 in {folder} (pip install --upgrade embreex)")
    return ctypes.CDLL(str(found[0]))


@cache
def _loop() -> ctypes.CDLL:
    """Compile embree_loop.c for this processor and load it; the file may be deleted once loaded."""
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "embree_loop.so"
        try:
            subprocess.run([*COMPILER, str(SOURCE), "-o", str(target)], check=True, capture_output=True, text=True)
        except FileNotFoundError:
            raise UsageError("no C compiler `cc` found, which the loop that calls Embree needs") from None
        except subprocess.CalledProcessError as error:
            raise UsageError(f"`cc` cannot compile {SOURCE}: {error.stderr}") from error
        return ctypes.CDLL(str(target))
