"""Samples of rays and paths: random work-groups, or blocks of an image, about as many as a multiprocessor gets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...device.open import Device
from ...errors import UsageError
from ...queries.mesh import RayQuery
from ...rendering.film.tiles import TILE, TILE_PIXELS
from ...scene.model import Scene
from ..rays.workloads import Workload, bumpy_ball, closed_room, workloads
from .record import PathRecorder, record_rays
from .visits import Ints, Visits, visits_of

#: Rays of a work-group, and tiles of a block: 32 pixels across, a warp's in a row.
GROUP, BLOCK_TILES = 64, 4
BLOCK = BLOCK_TILES * TILE_PIXELS


@dataclass(frozen=True)
class Sample:
    """Visits of a sample of the rays or paths. data_bytes: of all arrays that the kernels read."""

    visits: Visits
    layout: str
    data_bytes: int


def sampled_queries(device: Device, layout: str, subdivisions: int, side: int, rays: int) -> dict[str, Sample]:
    """Return samples of about `rays` rays by kind, see `workloads`: whole work-groups."""
    ball = bumpy_ball(subdivisions)
    room = closed_room(*ball)
    query = RayQuery(*room, device=device.info.index, layout=layout, builder="ploc", traversal="single")
    kinds = workloads(*room, ball[0], query.closest_hit, (side, side))
    return {kind.name: _sampled(query, kind, rays) for kind in kinds}


def _sampled(query: RayQuery, kind: Workload, rays: int) -> Sample:
    groups = _chosen(len(kind.rays[2]) // GROUP, rays // GROUP)
    chosen = (groups[:, None] * GROUP + np.arange(GROUP)).ravel()
    origins, directions, t_max = (array[chosen] for array in kind.rays)
    record = record_rays(query, (origins, directions, t_max), any_hit=kind.any_hit)
    return Sample(visits_of(record), query.tree.name, record.data_bytes)


def sampled_paths(device: Device, scene: Scene, layout: str, size: int, paths: int) -> Sample:
    """Return a sample of about `paths` paths of an image of size² pixels, in whole blocks. Raises UsageError if
    size is not a multiple of a block's width."""
    if size % (BLOCK_TILES * TILE):
        raise UsageError(f"size {size}: give a multiple of {BLOCK_TILES * TILE} pixels")
    across = size // TILE
    blocks = _chosen(across * across // BLOCK_TILES, paths // BLOCK)
    tiles = (blocks[:, None] * BLOCK_TILES + np.arange(BLOCK_TILES)).ravel()
    return _paths(PathRecorder(device, scene, layout, (size, size)), tiles)


def all_paths(device: Device, scene: Scene, layout: str, size: tuple[int, int]) -> Sample:
    """Return a path through each pixel of an image of (width, height)."""
    tiles = -(-size[0] // TILE) * -(-size[1] // TILE)
    return _paths(PathRecorder(device, scene, layout, size), np.arange(tiles))


def _paths(recorder: PathRecorder, tiles: NDArray[np.int64]) -> Sample:
    record = recorder.record(tiles.astype(np.uint32))
    visits = visits_of(record)
    if not visits.rays:
        raise UsageError("no ray enters a BVH, so there are no warps to simulate; choose a scene with more primitives")
    return Sample(visits, record.layout.name, record.data_bytes)


def _chosen(count: int, wanted: int, seed: int = 0) -> Ints:
    """Return numbers below `count` in order, chosen at random: equal distances could follow an image's columns."""
    return np.sort(np.random.default_rng(seed).choice(count, min(count, max(1, wanted)), replace=False))


def by_rows(paths: int) -> Ints:
    """Return the position of each path, if the pixels of a block are taken row by row instead of tile by tile."""
    path = np.arange(paths)
    block, tile, y, x = path // BLOCK, path % BLOCK // TILE_PIXELS, path % TILE_PIXELS // TILE, path % TILE
    return block * BLOCK + y * BLOCK_TILES * TILE + tile * TILE + x
