"""Binning of visible primitives for the integrator `raster` (kernels/raster)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from ...device.launches.data_parallel import DataParallel
from ...device.launches.launch import calling
from ...device.memory_plan import check_room, size
from ...device.open import Device
from ...errors import NoRoomError
from ..compile.compile_scene import CompiledScene
from ..compile.records import OUTLINE
from ..film.tiles import tiles_of

#: As in kernels/raster/bins.cl: number of bin sizes, and the ratio between successive sizes.
LEVELS, WIDER = 3, 8
#: Fields of a LAUNCH record that determine which primitives are visible where.
VIEW = ("position", "right", "up", "forward", "width", "height")
#: Maximum number of entries and outlines, which are numbered with uint32.
MOST = 2**32 - 1


def bin_count(picture: tuple[int, int]) -> int:
    """Return the number of bins of all sizes for an image of (width, height)."""
    rows, columns = tiles_of(picture)
    count = 0
    for _ in range(LEVELS):
        count += rows * columns
        rows, columns = -(-rows // WIDER), -(-columns // WIDER)
    return count


def drawn_before(compiled: CompiledScene) -> NDArray[np.int64]:
    """Return (k + 1,): the triangles drawn in the instances before each (k = 1 without instances), and the total."""
    total = int(compiled.counts["triangles"][0])
    if "placements" not in compiled.buffers:
        return np.array([0, total])
    firsts = compiled.buffers["placements"][1]["first"].astype(np.int64)
    ends = np.append(np.unique(firsts), total)
    faces = ends[np.searchsorted(ends, firsts, side="right").clip(max=len(ends) - 1)] - firsts
    return np.append(0, np.cumsum(faces))


class RasterBins:
    """Bins of one camera at a time, on a device. scene_arguments: leading arguments of every kernel of the scene.

    Raises NoRoomError if more primitives are to be drawn than can be numbered.
    """

    def __init__(self, device: Device, compiled: CompiledScene, scene_arguments: list[Any]) -> None:
        self._device, self._scene = device, scene_arguments
        before = drawn_before(compiled)
        self._drawn = int(before[-1]), int(compiled.counts["spheres"][0])
        if sum(self._drawn) > MOST:
            raise NoRoomError(
                f"{sum(self._drawn)} primitives are too many to rasterise, at most {MOST}; use the "
                "integrator local, or fewer instances"
            )
        self._blocks = DataParallel(device, compiled.source_of("raster/outline.cl"))
        self._before, self._instances = self._blocks.upload(before.astype(np.uint32)), len(before) - 1
        self._view = b""
        self._held: list[cl.Buffer] = []

    @property
    def bytes(self) -> int:
        """Memory of the bins and of their entries."""
        return sum(buffer.size for buffer in self._held)

    def of(self, launch: NDArray[Any], needs: Mapping[str, int]) -> list[cl.Buffer]:
        """Return the last arguments of the raster kernel for the camera of a LAUNCH record. Raises NoRoomError if it
        sees too much.

        needs: bytes of everything else on the device, by name.
        """
        view = b"".join(launch[name].tobytes() for name in VIEW)
        if view != self._view:
            self._view = b""
            with calling():
                self._sort(launch[0], needs)
            self._view = view
        return self._held

    def _sort(self, launch: np.void, needs: Mapping[str, int]) -> None:
        blocks, bins = self._blocks, bin_count((int(launch["width"]), int(launch["height"])))
        blocks.free(*self._held)
        self._held = []
        nothing, numbers, counts = blocks.empty(np.uint32, 1), blocks.zeros(np.uint32, 1), blocks.zeros(np.uint32, bins)
        self._run(launch, 0, numbers, counts, nothing, nothing)
        starts = np.append(0, np.cumsum(blocks.download(counts, np.uint32, bins), dtype=np.int64))
        seen = int(blocks.download(numbers, np.uint32, 1)[0])
        self._check(needs, starts.astype(np.uint32).nbytes, 4 * int(starts[-1]), seen * OUTLINE.itemsize)
        self._held = [
            blocks.upload(starts.astype(np.uint32)),
            blocks.empty(np.uint32, int(starts[-1])),
            blocks.empty(OUTLINE, seen),
        ]
        places = blocks.upload(starts[:-1].astype(np.uint32))
        numbers_again = blocks.zeros(np.uint32, 1)
        self._run(launch, 1, numbers_again, places, *self._held[1:])
        blocks.finish()
        blocks.free(nothing, numbers, numbers_again, counts, places)

    def _run(self, launch: np.void, fill: int, *sorted_into: cl.Buffer) -> None:
        triangles, spheres = self._drawn
        arguments = *self._scene, launch, fill, *sorted_into
        if triangles:
            self._blocks.run_each("sort_triangles", triangles, *arguments, self._before, self._instances)
        if spheres:
            self._blocks.run_each("sort_spheres", spheres, *arguments)

    def _check(self, needs: Mapping[str, int], *sizes: int) -> None:
        info = self._device.info
        check_room(info, {**needs, **dict(zip(("bin_starts", "bin_entries", "outlines"), sizes))})
        if max(sizes) > info.max_alloc_bytes:
            raise NoRoomError(
                f"{info.name}: rasterising this view needs a buffer of {size(max(sizes))}, and buffers "
                f"of this device have at most {size(info.max_alloc_bytes)}; use the integrator local, a "
                "smaller image or fewer primitives"
            )
