"""Recording of what rays visit, in order, by the kernels themselves (kernels/traverse/visits.cl).

A program with buffers for it appends a word per visit to its work-item's range. The first run counts the words of each
work-item, the second one writes them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...accel.layouts import Layout
from ...accel.traversal_kernels import tree_buffers
from ...device.launches.device_arrays import DeviceArray, resident
from ...device.launches.launch import LaunchSize, run_kernel
from ...device.open import Device
from ...device.programs.program import BuiltProgram, build, compose, make_kernel
from ...errors import UsageError
from ...queries.base import CHUNK, TreeQuery
from ...rendering.accumulation.launch_plan import LaunchPlan, block_bits
from ...rendering.compile.camera_kernel import launch_record
from ...rendering.compile.choices import Choices
from ...rendering.compile.compile_scene import KERNELS, MEGAKERNEL
from ...rendering.compile.features import WITH_LIGHT, features_of, files_for, preamble_of
from ...rendering.compile.film_record import pixel_record
from ...rendering.compile.pack_scene import PackedScene, pack_scene
from ...rendering.compile.reuse_cache import ReuseCache
from ...rendering.film.tiles import TILE_PIXELS
from ...scene.model import Scene
from ...scene.validation.validate import validate
from ..rays.ray_speed import Rays

Buffers = dict[str, NDArray[Any]]
RANGE = np.dtype([("next", "u4"), ("end", "u4")])
WORD = np.dtype([("word", "u4")])


@dataclass(frozen=True)
class Record:
    """Words of all work-items, one after another. counts: words per work-item; layout: of the BVH that was traversed;
    data_bytes: size of all arrays that kernels read."""

    words: NDArray[np.uint32]
    counts: NDArray[np.int64]
    layout: Layout
    data_bytes: int


def record_rays(query: TreeQuery, rays: Rays, *, any_hit: bool) -> Record:
    """Record closest hits or any hit of at most CHUNK rays. Raises UsageError for more, and for traversals other than
    of single rays."""
    if len(rays[2]) > CHUNK or query._traversal != "single":
        raise UsageError(f"{len(rays[2])} rays, traversal {query._traversal}: at most {CHUNK} single rays are recorded")

    def run(buffers: Buffers) -> Mapping[str, DeviceArray]:
        recording = _Recording(query, buffers, len(rays[2]))
        (recording.any_hit if any_hit else recording.closest_hit)(*rays)
        return recording.tree.buffers

    words, counts = _in_two_runs(query.device, -(-len(rays[2]) // query.device.lanes), run)
    return Record(words, counts, query.tree, query.tree.bytes)


class _Recording(TreeQuery):
    """Query with the same results as another one that also records, in a single launch."""

    def __init__(self, query: TreeQuery, buffers: Buffers, rays: int) -> None:
        tree = replace(query.tree, buffers={**query.tree.buffers, **buffers})
        counts = int(query._counts["triangles"][0]), int(query._counts["spheres"][0])
        super().__init__(query.device, tree, counts, query.frame, query._tests, query._traversal)
        self._sizes = {name: LaunchSize(rays) for name in self._sizes}


class PathRecorder:
    """A scene's megakernel, one path per work-item, that records a sample of each pixel.

    size: of the image. Raises UsageError for integrators that follow no paths.
    """

    def __init__(self, device: Device, scene: Scene, layout: str, size: tuple[int, int]) -> None:
        validate(scene)
        if scene.render.integrator not in WITH_LIGHT:
            raise UsageError(
                f"the integrator {scene.render.integrator} follows no paths; choose one of {', '.join(WITH_LIGHT)}"
            )
        self._choices = Choices(lanes=1, layout=layout).on(device)
        self._device, self._size = device, size
        self.packed = pack_scene(scene, self._choices, device, ReuseCache())
        self._plan = LaunchPlan.of(scene.render, 1)
        self._program: BuiltProgram | None = None

    def record(self, tiles: NDArray[np.uint32]) -> Record:
        """Record the pixels of these tiles, numbered row by row; a work-item per pixel, row by row in each tile."""
        words, counts = _in_two_runs(self._device, len(tiles) * TILE_PIXELS, lambda buffers: self._run(tiles, buffers))
        own = sum(array.nbytes for _, array in self.packed.buffers.values())
        return Record(words, counts, self.packed.tree, own)

    def _run(self, tiles: NDArray[np.uint32], buffers: Buffers) -> Mapping[str, DeviceArray]:
        device, packed = self._device, _with_buffers(self.packed, buffers)
        if self._program is None:
            self._program = build(device, self._source(packed))
        pixels = len(tiles) * TILE_PIXELS
        launch = launch_record(packed.scene.camera, self._size)
        launch["max_depth"], launch["seed"] = self._plan.max_depth, self._plan.seed
        launch["pixel_count"], launch["sample_count"], launch["block_bits"] = pixels, 1, block_bits(1)
        launch["clamp_direct"] = launch["clamp_indirect"] = np.inf
        scene = {name: resident(device, array) for name, (_, array) in packed.buffers.items()}
        pixel = pixel_record(self.packed.film, len(self.packed.groups))
        film = resident(device, np.zeros(self._size[0] * self._size[1], pixel))
        chosen = resident(device, tiles)
        kernel = make_kernel(device, self._program, KERNELS[MEGAKERNEL])
        arguments = [array.buffer for array in scene.values()]
        kernel.set_args(*arguments, packed.counts[0], film.buffer, chosen.buffer, launch[0])
        run_kernel(device, kernel, -(-pixels // device.local_size))
        return scene

    def _source(self, packed: PackedScene) -> str:
        features = features_of(packed, self._choices, loop_limit=False)
        files = files_for(packed, self._choices, features)
        return compose(preamble_of(packed, self._choices, features, None), MEGAKERNEL, files)


def _with_buffers(packed: PackedScene, buffers: Buffers) -> PackedScene:
    """Return the packed scene with buffers in its tree, from which its program records (see `tree_defines`)."""
    tree = replace(packed.tree, buffers={**packed.tree.buffers, **buffers})
    return replace(packed, tree=tree, buffers={**packed.buffers, **tree_buffers(tree)})


def _in_two_runs(
    device: Device, items: int, run: Callable[[Buffers], Mapping[str, DeviceArray]]
) -> tuple[NDArray[np.uint32], NDArray[np.int64]]:
    """Return the words and their number for each of `items` work-items. run: launches the kernel with these buffers and
    returns them on the device."""
    ranges = np.zeros(items, RANGE)
    after = run({"visit_ranges": ranges, "visit_words": np.zeros(1, WORD)})
    counts = after["visit_ranges"].read(device)["next"].astype(np.int64)
    ranges["end"] = np.cumsum(counts)
    ranges["next"] = ranges["end"] - counts
    after = run({"visit_ranges": ranges, "visit_words": np.zeros(max(1, int(counts.sum())), WORD)})
    return after["visit_words"].read(device)["word"][: counts.sum()], counts
